// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "cell/cell_config.h"

namespace corbot::cell {

struct Detection {
  std::string kind;
  Eigen::Vector3d position_m{};  ///< middle of the foot, world
  double confidence{};           ///< 0 … 1: see Detector
  double yaw_rad{0};             ///< square kinds: direction of a side about z, from -pi/4 up to pi/4
};

/// Finds standing pieces by the coloured labels on their tops. A piece counts if its foot is over a place, or
/// at most 10 mm beyond the edge. The detector compares each blob of a kind's colour with the label's
/// expected outline. The confidence is the intersection of blob and outline, divided by their union. The
/// detector drops blobs below 0.82: they are not labels, or an arm hides part of the label.
class Detector {
 public:
  /// Copies camera, places and kinds. Throws ConfigError if the picture does not show a place whole.
  explicit Detector(const CellConfig& cell);

  /// Returns the pieces in a picture of the calibration's size. The picture consists of rows of pixels; a
  /// pixel has three bytes: blue, green, red. Throws std::invalid_argument for another size. Not real-time
  /// safe.
  [[nodiscard]] std::vector<Detection> detect(std::span<const std::uint8_t> bgr) const;

 private:
  /// A rectangle of the picture, in pixels, that contains every label over one place.
  struct Window {
    Place place;
    int left{};
    int top{};
    int columns{};
    int rows{};
  };

  CameraModel camera_;
  std::vector<Kind> kinds_;
  std::vector<Window> windows_;
};

}  // namespace corbot::cell
