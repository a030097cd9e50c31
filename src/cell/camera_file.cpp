// SPDX-License-Identifier: Apache-2.0
#include "cell/camera_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>

#include "config/load_profile.h"
#include "corbot/units.h"

namespace corbot::cell {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d vector3(Section& section, std::string_view key, const Bounds& allowed) {
  const auto numbers = section.numbers(key, 3, allowed);
  return numbers ? Vector3d((*numbers)[0], (*numbers)[1], (*numbers)[2]) : Vector3d::Zero();
}

Vector2d vector2(Section& section, std::string_view key, const Bounds& allowed) {
  const auto numbers = section.numbers(key, 2, allowed);
  return numbers ? Vector2d((*numbers)[0], (*numbers)[1]) : Vector2d::Zero();
}

UprightFrame frame(Section& section) {
  const Vector3d position = vector3(section, "position_m");
  return {position,
          section.number_or("yaw_deg", 0, {-360, 360, false, "degrees"}).value_or(0) * kRadiansPerDegree};
}

std::optional<CameraModel> read_camera(const fs::path& file, std::vector<ConfigFault>& all) {
  CameraModel camera;
  FaultList faults{file.string(), {}};
  try {
    const toml::table table = toml::parse(read_profile_text(file), faults.file);
    Section section(&table, "", faults);
    const Vector2d size = vector2(section, "size_px", {16, 8192, false, "px"});
    if (size != size.array().round().matrix()) section.refuse("size_px", "must be two whole numbers");
    camera.size_px = {static_cast<int>(size.x()), static_cast<int>(size.y())};
    camera.focal_px = vector2(section, "focal_px", {1, 1e6, false, "px"});
    camera.centre_px = vector2(section, "centre_px", {-1e5, 1e5, false, "px"});
    if (const auto k = section.numbers("distortion", 5, {-10, 10, false, "(k1 k2 p1 p2 k3)"}))
      std::copy(k->begin(), k->end(), camera.distortion.begin());
    camera.position_m = vector3(section, "position_m");
    if (const auto q = section.numbers("quaternion_wxyz", 4, {-1, 1, false, ""})) {
      camera.world_T_camera = Eigen::Quaterniond((*q)[0], (*q)[1], (*q)[2], (*q)[3]);
      if (std::abs(camera.world_T_camera.norm() - 1) > 1e-3)
        section.refuse("quaternion_wxyz", "must be a unit quaternion, w x y z");
      camera.world_T_camera.normalize();
    }
    section.skip("residual_px");
    section.finish();
  } catch (const toml::parse_error& error) {
    faults.add(error.source().begin.line, "", "", fmt::format("not TOML: {}", error.description()));
  } catch (const ConfigError& error) {
    faults.faults.insert(faults.faults.end(), error.faults().begin(), error.faults().end());
  }
  all.insert(all.end(), faults.faults.begin(), faults.faults.end());
  return faults.faults.empty() ? std::optional(camera) : std::nullopt;
}

}  // namespace corbot::cell
