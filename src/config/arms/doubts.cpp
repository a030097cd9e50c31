// SPDX-License-Identifier: Apache-2.0
#include "config/arms/doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <locale>
#include <numbers>
#include <sstream>
#include <string_view>
#include <variant>

#include "config/arms/recognise.h"

namespace corbot::config {

std::string other_reading(const DhTable& table, const Joints& home_q) {
  const auto is_other = [&](const DhTable& read) {
    return std::holds_alternative<OtherArm>(recognise_arm(at_home(read, home_q)).kinematics.form());
  };
  const bool is_standard = table.convention == DhConvention::kStandard;
  DhTable swapped = table;
  swapped.convention = is_standard ? DhConvention::kModified : DhConvention::kStandard;
  if (table.count == 0 || !is_other(table) || is_other(swapped)) return "";
  return fmt::format("as \"{}\" it is of the family '{}'", is_standard ? "modified" : "standard",
                     recognise_arm(at_home(swapped, home_q)).kinematics.family());
}

std::optional<double> degrees_if_radians(double angle_rad) {
  constexpr double kStep = std::numbers::pi / 4;
  constexpr double kRounded = 5e-4;
  const double value = angle_rad * 180.0 / std::numbers::pi;  // the value as written
  const double steps = std::round(value / kStep);
  if (steps == 0.0 || std::abs(steps) > 8.0 || std::abs(value - steps * kStep) > kRounded)
    return std::nullopt;
  return steps * 45.0;
}

std::string rotation_in_degrees(const std::string& urdf) {
  constexpr std::string_view kKey = "rpy=";
  constexpr double kMost = 7.0;  // more than a turn
  for (std::size_t at = urdf.find(kKey); at != std::string::npos; at = urdf.find(kKey, at + 1)) {
    const std::size_t first = at + kKey.size() + 1;
    const std::size_t end = urdf.find_first_of("\"'", first);
    if (end == std::string::npos) break;
    std::string text = urdf.substr(first, std::min<std::size_t>(end - first, 100));
    std::istringstream numbers(text);
    numbers.imbue(std::locale::classic());
    for (double angle{}; numbers >> angle;) {
      if (std::abs(angle) > kMost) return text;
    }
  }
  return "";
}

}  // namespace corbot::config
