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
  /// Returns the result as text. Throws Differs if the check does not hold. Any CORBA exception from it is an
  /// unexpected one.
  std::string (*examine)(Session&);
};

/// The checks in their order. The first ones move nothing.
[[nodiscard]] std::span<const Check> read_checks();
[[nodiscard]] std::span<const Check> motion_checks();

}  // namespace corbot::cli
