// SPDX-License-Identifier: Apache-2.0
#include "robot/further_workspace.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace corbot {
namespace {

constexpr double kSameBase = 1e-6;  // m, and of a unit quaternion: the message gives as many digits

bool are_same(const Pose& a, const Pose& b) {
  const Quaternion &p = a.orientation, &q = b.orientation;
  const double same = p.w * q.w + p.x * q.x + p.y * q.y + p.z * q.z;
  const double sign = same < 0.0 ? -1.0 : 1.0;  // both signs are the same orientation
  const Quaternion apart{p.w - sign * q.w, p.x - sign * q.x, p.y - sign * q.y, p.z - sign * q.z};
  return norm(a.position_m - b.position_m) <= kSameBase && std::sqrt(squared_norm(apart)) <= kSameBase;
}

/// Returns the numbers that `corbot base` takes.
std::string text_of(const Pose& base) {
  std::array<double, 7> n{base.position_m[0], base.position_m[1], base.position_m[2], base.orientation.w,
                          base.orientation.x, base.orientation.y, base.orientation.z};
  constexpr double kDigits = 1e7;
  for (double& each : n) each = std::round(each * kDigits) / kDigits + 0.0;  // without a negative 0
  return fmt::format("{:.9g}", fmt::join(n, " "));
}

}  // namespace

bool FurtherWorkspace::is_known_at(const Pose& world_T_base) const {
  if (!is_known()) return false;
  const auto placed = wanted();
  return !placed || placed->further.count == 0 || are_same(placed->world_T_base, world_T_base);
}

std::optional<FurtherShapes> FurtherWorkspace::shapes() const {
  const auto placed = wanted();
  return placed ? std::optional(placed->further) : std::nullopt;
}

void FurtherWorkspace::check_known_at(const MotionRequest& request, const Pose& world_T_base) const {
  check_known(request);
  if (!moves_joints(request) || is_known_at(world_T_base)) return;
  const auto placed = wanted();
  if (!placed) return check_known(request);
  throw not_ready(fmt::format(
      "the planes and boxes of clients hold for base {}: set that base, or set or reset them; the base is {}",
      text_of(placed->world_T_base), text_of(world_T_base)));
}

}  // namespace corbot
