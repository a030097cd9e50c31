// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cell.hh"

namespace corbot::cell {

/// Describes a store's refusal for a person.
[[nodiscard]] std::string refusal_text(const Corbot::BadParameter& error);
[[nodiscard]] std::string refusal_text(const Corbot::Full& error);
[[nodiscard]] std::string refusal_text(const Corbot::Occupied& error);

}  // namespace corbot::cell
