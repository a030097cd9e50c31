// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "cli/conform/session.h"

namespace corbot::cli {

struct Check {
  std::string_view name;
  bool is_for_cell;  ///< the pick-and-place cell needs it
  std::string_view expected;
  /// What came. Throws Differs where it does not hold; an exception of CORBA is none that was expected.
  std::string (*examine)(Session&);
};

/// In the order in which they are made. The first ones move nothing.
[[nodiscard]] std::span<const Check> read_checks();
[[nodiscard]] std::span<const Check> motion_checks();

}  // namespace corbot::cli
