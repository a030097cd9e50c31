// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "corbot/kinematics/arm_parts.h"
#include "corbot/kinematics/pose.h"

// Where parts of an arm may be: floors, planes, boxes. Plain data. Real-time safe.

namespace corbot {

/// The points at or above a plane: dot(normal, p) >= offset_m.
struct HalfSpace {
  Vector3 normal{0.0, 0.0, 1.0};  ///< unit vector into the allowed side
  double offset_m{};
  friend constexpr bool operator==(const HalfSpace&, const HalfSpace&) = default;
};

[[nodiscard]] constexpr double clearance_m(const HalfSpace& face, const Vector3& point_m) noexcept {
  return dot(face.normal, point_m) - face.offset_m;
}

enum class ShapeKind : std::uint32_t {
  kPlane,   ///< one face
  kInside,  ///< a box to stay within: a point is on the allowed side of all faces
  kOutside  ///< a box to stay out of: a point is on the allowed side of one face at least
};

/// A plane or a box that some parts of the arm keep to, in the frame of given positions.
struct WorkspaceShape {
  static constexpr std::size_t kMostFaces = 6;
  static constexpr std::size_t kLongestName = 32;
  ShapeKind kind{ShapeKind::kPlane};
  std::uint32_t parts{};  ///< the bits of the parts it holds for, kinematics/arm_parts.h
  std::uint32_t face_count{};
  std::array<HalfSpace, kMostFaces> faces{};
  std::array<char, kLongestName + 1> name{};
  friend constexpr bool operator==(const WorkspaceShape&, const WorkspaceShape&) = default;
};

/// Returns the clearance of a point: the least of all faces, or the greatest for a box to stay out of.
/// Beyond the shape it is negative, and minus the depth.
[[nodiscard]] inline double clearance_m(const WorkspaceShape& shape, const Vector3& point_m) noexcept {
  const bool any = shape.kind == ShapeKind::kOutside;
  double found_m = (any ? -1.0 : 1.0) * std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < shape.face_count; ++i) {
    const double face_m = clearance_m(shape.faces[i], point_m);
    found_m = any ? std::max(found_m, face_m) : std::min(found_m, face_m);
  }
  return found_m;
}

/// Returns the least clearance of the points between two. From a box to stay out of, each point has the
/// clearance of one face. Their greatest is convex along the way, so its least lies at an end or where a
/// falling face meets a rising one.
[[nodiscard]] inline double clearance_m(const WorkspaceShape& shape, const Vector3& from_m,
                                        const Vector3& to_m) noexcept {
  if (shape.kind != ShapeKind::kOutside)
    return std::min(clearance_m(shape, from_m), clearance_m(shape, to_m));
  struct Line {
    double start_m, slope_m, here_m;  ///< of a face, along the way from 0 to 1
  };
  std::array<Line, WorkspaceShape::kMostFaces> lines{};
  for (std::size_t i = 0; i < shape.face_count; ++i) {
    const double start_m = clearance_m(shape.faces[i], from_m);
    lines[i] = {start_m, clearance_m(shape.faces[i], to_m) - start_m, 0.0};
  }
  const auto top = [&](double at) {
    Line found{0.0, 0.0, -std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < shape.face_count; ++i) {
      const double here_m = lines[i].start_m + at * lines[i].slope_m;
      if (here_m > found.here_m) found = {lines[i].start_m, lines[i].slope_m, here_m};
    }
    return found;
  };
  constexpr double kMeeting_m = 1e-12;
  Line falling = top(0.0), rising = top(1.0);
  if (falling.slope_m >= 0.0) return falling.here_m;
  if (rising.slope_m <= 0.0) return rising.here_m;
  double least_m = std::min(falling.here_m, rising.here_m);
  for (std::size_t i = 0; i < WorkspaceShape::kMostFaces; ++i) {
    const double at = (rising.start_m - falling.start_m) / (falling.slope_m - rising.slope_m);
    const Line here = top(std::clamp(at, 0.0, 1.0));
    least_m = std::min(least_m, here.here_m);
    if (here.slope_m == 0.0 || here.here_m <= falling.start_m + at * falling.slope_m + kMeeting_m) break;
    (here.slope_m < 0.0 ? falling : rising) = here;
  }
  return least_m;
}

/// A part may be beyond a shape by this much, and is refused from half of it on. In between the proof may
/// decide either way.
inline constexpr double kWorkspaceTolerance_m = 1e-6;

/// Planes and boxes that clients set at run time. They hold beside the profile's.
struct FurtherShapes {
  static constexpr std::size_t kMostShapes = 8;
  std::uint64_t count{};
  std::array<WorkspaceShape, kMostShapes> shapes{};
  friend constexpr bool operator==(const FurtherShapes&, const FurtherShapes&) = default;
};
static_assert(std::is_trivially_copyable_v<FurtherShapes>);

/// All shapes of an arm; none: the arm may be anywhere.
struct WorkspaceLimits {
  static constexpr std::size_t kMostOfProfile = 16;
  static constexpr std::size_t kMostShapes = kMostOfProfile + FurtherShapes::kMostShapes;
  std::uint32_t count{};
  std::array<WorkspaceShape, kMostShapes> shapes{};
  std::array<double, kArmLinks> link_radius_m{};  ///< around a link from end to end; 0: not known
};
static_assert(std::is_trivially_copyable_v<WorkspaceLimits>);

[[nodiscard]] inline double radius_m(const WorkspaceLimits& limits, std::size_t part) noexcept {
  return part < kFirstLink ? 0.0 : limits.link_radius_m[part - kFirstLink];
}

/// Returns the clearance of a part: of a link, that of its axis less its radius.
[[nodiscard]] inline double clearance_m(const WorkspaceLimits& limits, std::size_t shape, std::size_t part,
                                        const PartEnds& ends, const ArmStates& states) noexcept {
  const Vector3& from_m = states[ends.from].position_m;
  if (part < kFirstLink) return clearance_m(limits.shapes[shape], from_m);
  return clearance_m(limits.shapes[shape], from_m, states[ends.to].position_m) - radius_m(limits, part);
}

/// Adds the further shapes, which need a count within bounds, behind those of the profile.
inline void add_shapes(WorkspaceLimits& limits, const FurtherShapes& further) noexcept {
  for (std::size_t k = 0; k < further.count && limits.count < limits.shapes.size(); ++k)
    limits.shapes[limits.count++] = further.shapes[k];
}

inline constexpr double kFarthestShape_m = 100.0;  ///< of a plane's offset and a box's corners

/// Checks shapes of another process: counts, kinds and numbers are such as the functions below return.
[[nodiscard]] inline bool are_sound(const FurtherShapes& further) noexcept {
  constexpr double kNormalTolerance = 1e-9;
  const auto is_sound_face = [](const HalfSpace& face) {
    return std::abs(dot(face.normal, face.normal) - 1.0) <= kNormalTolerance &&
           std::abs(face.offset_m) <= kFarthestShape_m;
  };
  const auto is_sound = [&](const WorkspaceShape& shape) {
    const bool is_plane = shape.kind == ShapeKind::kPlane;
    if (!is_plane && shape.kind != ShapeKind::kInside && shape.kind != ShapeKind::kOutside) return false;
    if (shape.face_count != (is_plane ? 1 : WorkspaceShape::kMostFaces)) return false;
    return std::all_of(shape.faces.begin(), shape.faces.begin() + shape.face_count, is_sound_face);
  };
  if (further.count > further.shapes.size()) return false;
  return std::all_of(further.shapes.begin(),
                     further.shapes.begin() + static_cast<std::ptrdiff_t>(further.count), is_sound);
}

/// Returns a plane whose allowed side is the one into which the unit vector points.
[[nodiscard]] inline WorkspaceShape plane_shape(const HalfSpace& face, std::uint32_t parts) noexcept {
  WorkspaceShape shape{ShapeKind::kPlane, parts, 1};
  shape.faces[0] = face;
  return shape;
}

/// Returns a box with edges along the axes. `from_m` has the lesser coordinates.
[[nodiscard]] inline WorkspaceShape box_shape(ShapeKind kind, const Vector3& from_m, const Vector3& to_m,
                                              std::uint32_t parts) noexcept {
  WorkspaceShape shape{kind, parts, WorkspaceShape::kMostFaces};
  const double outwards = kind == ShapeKind::kOutside ? 1.0 : -1.0;
  for (std::size_t i = 0; i < 3; ++i) {
    Vector3 axis{};
    axis[i] = outwards;
    shape.faces[2 * i] = {axis, outwards * to_m[i]};
    shape.faces[2 * i + 1] = {-1.0 * axis, -outwards * from_m[i]};
  }
  return shape;
}

}  // namespace corbot
