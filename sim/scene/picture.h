// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "sim/scene/capsule.h"

namespace corbot::sim {

/// A cylinder or a square prism as a picture shows it: a dark body with a coloured label on top.
struct DrawnPiece {
  Eigen::Vector3d foot_m{};  ///< world; lying: the point of the surface below its middle
  double width_m{};          ///< diameter, or side of a square
  double height_m{};
  double label_m{};  ///< label's diameter, or side
  std::array<std::uint8_t, 3> label_bgr{};
  bool is_lying{false};  ///< its label is not visible
  double yaw_rad{0};     ///< lying: direction of its axis; standing and square: direction of a side
  bool is_square{false};
};

struct PictureOptions {
  int columns{1280};
  int rows{720};
  double noise{4};  ///< 1 sigma of 255
  std::uint64_t seed{1};
  /// Returns the pixel at which a point of the world is seen; nothing if the point is not ahead of the
  /// camera.
  std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector3d&)> project;
};

/// Draws the scene as the true camera sees it: from low to high, with anti-aliasing and noise. Not real-time
/// safe. A piece that is taller than its neighbour does not hide the neighbour's label.
class Picture {
 public:
  explicit Picture(PictureOptions options);
  ~Picture();
  /// Returns rows of pixels, three bytes each: blue, green, red; valid until the next call. `arms` hide what
  /// is under them.
  [[nodiscard]] const std::vector<std::uint8_t>& draw(std::span<const DrawnPiece> pieces,
                                                      std::span<const Capsule> arms);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace corbot::sim
