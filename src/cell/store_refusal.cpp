// SPDX-License-Identifier: Apache-2.0
#include "cell/store_refusal.h"

#include <fmt/format.h>

#include <string_view>

#include "client/explain.h"

namespace corbot::cell {

using client::printable;

std::string refusal_text(const Corbot::BadParameter& error) {
  const std::string_view parameter = error.parameter.in();
  std::string reason = printable(error.reason.in());
  if (parameter == "place" || parameter == "robot") return reason;  // the value is only a length
  if (parameter == "slot" && error.value == -1) return "give a SLOT: it " + reason;
  return fmt::format("{} {:g}: {}", printable(error.parameter.in()), error.value, reason);
}

std::string refusal_text(const Corbot::Full& error) {
  return fmt::format("that slot of {} is occupied or reserved", printable(error.place.in()));
}

std::string refusal_text(const Corbot::Occupied& error) {
  return fmt::format("{} uses {}: wait until it has ended its piece", printable(error.robot.in()),
                     printable(error.place.in()));
}

}  // namespace corbot::cell
