// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "corbot/arm/workspace_limits.h"

namespace corbot {

/// The numbers that make a shape, as a profile has them. A plane has the first two, a box the others.
struct ShapeNumbers {
  Vector3 normal{};
  double offset_m{};
  Vector3 from_m{}, to_m{};
};

/// Returns the numbers of a plane or box that plane_shape() or box_shape() returned.
[[nodiscard]] inline ShapeNumbers numbers_of(const WorkspaceShape& shape) noexcept {
  ShapeNumbers numbers;
  if (shape.kind == ShapeKind::kPlane) {
    numbers.normal = shape.faces[0].normal;
    numbers.offset_m = shape.faces[0].offset_m;
    return numbers;
  }
  const double outwards = shape.kind == ShapeKind::kOutside ? 1.0 : -1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    numbers.to_m[i] = outwards * shape.faces[2 * i].offset_m + 0.0;  // no -0
    numbers.from_m[i] = -outwards * shape.faces[2 * i + 1].offset_m + 0.0;
  }
  return numbers;
}

/// Returns the shape of these numbers. The normal is a unit vector.
[[nodiscard]] inline WorkspaceShape shape_of(ShapeKind kind, std::uint32_t parts,
                                             const ShapeNumbers& numbers) noexcept {
  if (kind == ShapeKind::kPlane) return plane_shape({numbers.normal, numbers.offset_m}, parts);
  return box_shape(kind, numbers.from_m, numbers.to_m, parts);
}

}  // namespace corbot
