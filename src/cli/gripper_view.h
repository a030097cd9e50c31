// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>

#include "arm.hh"

// The gripper in the output of `status`.

namespace corbot::cli {

[[nodiscard]] inline const char* to_string(Corbot::GripperState state) {
  return state == Corbot::Open ? "open" : "closed";
}

/// Returns "closed"; "closed, at 0 %"; "closed, at 0 %, measured 41 %, holds something".
[[nodiscard]] inline std::string gripper_text(Corbot::GripperState state,
                                              const std::optional<Corbot::GripperInfo>& shown) {
  if (!shown) return to_string(state);
  const Corbot::GripperInfo& info = *shown;
  if (!info.measured)
    return fmt::format("{}, at {:.0f} %", to_string(state), std::round(info.commanded) + 0.0);
  const char* const holding = info.holding == Corbot::HoldingYes  ? ", holds something"
                              : info.holding == Corbot::HoldingNo ? ", holds nothing"
                                                                  : "";
  return fmt::format("{}, at {:.0f} %, measured {:.0f} %{}", to_string(state),
                     std::round(info.commanded) + 0.0, std::round(info.opening) + 0.0, holding);
}

}  // namespace corbot::cli
