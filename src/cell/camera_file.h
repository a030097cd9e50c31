// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "cell/camera_model.h"
#include "cell/frames.h"
#include "config/section.h"

// Functions that the readers of a cell's files share.

namespace corbot::cell {

inline constexpr Bounds kPosition{-10, 10, false, "m"};

/// Reads three numbers of a key. Reports a fault and then returns zeros.
[[nodiscard]] Eigen::Vector3d vector3(Section& section, std::string_view key,
                                      const Bounds& allowed = kPosition);
[[nodiscard]] Eigen::Vector2d vector2(Section& section, std::string_view key, const Bounds& allowed);

/// Reads the keys position_m and yaw_deg.
[[nodiscard]] UprightFrame frame(Section& section);

/// Reads a camera's model. Adds faults to `all`, and then returns nothing.
[[nodiscard]] std::optional<CameraModel> read_camera(const std::filesystem::path& file,
                                                     std::vector<ConfigFault>& all);

}  // namespace corbot::cell
