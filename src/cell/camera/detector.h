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
  double confidence{};           ///< 0 … 1, see Detector
};

/// Finds standing pieces by the coloured labels on their tops. A piece counts whose foot is over a place, or at
/// most 10 mm beyond its edge. The detector compares a blob of the kind's colour with the label's outline that is
/// expected there. The confidence is the area that both share, divided by the area that they cover together.
/// Below 0.82 the blob is no label, or an arm hides part of the label, and the blob is left out.
class Detector {
 public:
  /// Keeps a copy of camera, places and kinds. Throws ConfigError for a place of which the picture shows a part.
  explicit Detector(const CellConfig& cell);

  /// The picture has the calibration's size: rows of pixels, three bytes each: blue, green, red. Throws
  /// std::invalid_argument for another size. Runs in the caller's thread. Not real-time safe.
  [[nodiscard]] std::vector<Detection> detect(std::span<const std::uint8_t> bgr) const;

 private:
  /// A rectangle of the picture, pixels, that holds every label over one place.
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
