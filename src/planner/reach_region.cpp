// SPDX-License-Identifier: Apache-2.0
#include "planner/reach_region.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "planner/workspace.h"

namespace corbot {
namespace {

constexpr std::size_t kInnerSamples =
    100000;                           // mark the inside, so that only boxes at the outline are halved
constexpr double kRounding_m = 1e-9;  // ends of the ranges lie at the borders of cells
constexpr double kMargin = 0.1;       // of the samples' extent, for positions beyond them

/// Joint values from centre - half to centre + half.
struct JointBox {
  Joints centre_q{}, half_q{};
};

/// A set that contains the projection of a box. It consists of centre + the sum of t·side for t in [-1, 1],
/// and of all points within rest_m of these.
struct Enclosure {
  PlanePoint centre{};
  std::array<PlanePoint, kMaxJoints> sides{};
  double rest_m{};
  std::size_t curved_joint{};  ///< the joint that contributes most to rest_m
};

/// Returns the enclosure by Taylor's theorem about the box's centre. For rotary joints i <= j the second
/// derivative is a_i x (a_j x r_j), at most the tool's distance from axis j. It is a_i x a_j, at most 1, if j
/// slides, and 0 if i slides.
Enclosure enclosure_of(const JointChain& chain, const DrawnPlane& plane, const JointBox& box) {
  Enclosure e;
  const Pose tool = forward(chain, box.centre_q);
  const Jacobian j = jacobian(chain, box.centre_q);
  e.centre = plane(tool.position_m);
  // Speed of the tool by joint i: at the centre, plus the most that the outer joints can add to the distance.
  std::array<double, kMaxJoints> speed{};
  double outer_m = 0.0;
  for (std::size_t i = chain.count; i-- > 0;) {
    const Vector3 column{j[0][i], j[1][i], j[2][i]};
    const PlanePoint p = plane.along(column);
    e.sides[i] = {box.half_q[i] * p[0], box.half_q[i] * p[1]};
    speed[i] = chain.axes[i].kind == JointKind::kRotary ? norm(column) + outer_m : 1.0;
    outer_m += box.half_q[i] * speed[i];
  }
  std::array<double, kMaxJoints> share_m{};
  for (std::size_t i = 0; i < chain.count; ++i) {
    if (chain.axes[i].kind != JointKind::kRotary) continue;
    share_m[i] += 0.5 * box.half_q[i] * box.half_q[i] * speed[i];
    for (std::size_t k = i + 1; k < chain.count; ++k) {
      const double both_m = 0.5 * box.half_q[i] * box.half_q[k] * speed[k];
      share_m[i] += both_m;
      share_m[k] += both_m;
    }
  }
  e.rest_m = kRounding_m;
  for (const double share : share_m) e.rest_m += share;
  e.curved_joint =
      static_cast<std::size_t>(std::max_element(share_m.begin(), share_m.end()) - share_m.begin());
  return e;
}

/// A polygon's corners in order, without memory of its own: there are millions of them.
class Corners {
 public:
  void add(const PlanePoint& corner) { at_[count_++] = corner; }
  [[nodiscard]] const PlanePoint* begin() const { return at_.data(); }
  [[nodiscard]] const PlanePoint* end() const { return at_.data() + count_; }

 private:
  std::array<PlanePoint, 2 * kMaxJoints + 1> at_{};
  std::size_t count_{0};
};

/// Returns the corners of centre + the sum of t·side: a polygon with two edges for each side.
Corners corners_of(const Enclosure& e) {
  std::array<PlanePoint, kMaxJoints> sides;
  std::size_t count = 0;
  PlanePoint at = e.centre;
  for (PlanePoint side : e.sides) {
    if (side[0] == 0.0 && side[1] == 0.0) continue;
    if (side[1] < 0.0 || (side[1] == 0.0 && side[0] < 0.0)) side = {-side[0], -side[1]};
    at = {at[0] - side[0], at[1] - side[1]};
    std::size_t place = count++;  // by their angles
    for (; place > 0 && sides[place - 1][0] * side[1] - sides[place - 1][1] * side[0] < 0.0; --place)
      sides[place] = sides[place - 1];
    sides[place] = side;
  }
  Corners corners;
  corners.add(at);
  for (const double sign : {2.0, -2.0}) {
    for (std::size_t i = 0; i < count; ++i) {
      at = {at[0] + sign * sides[i][0], at[1] + sign * sides[i][1]};
      corners.add(at);
    }
  }
  return corners;
}

class Marking {
 public:
  explicit Marking(ReachRegion& region) : region_(region) {}

  [[nodiscard]] bool holds(const Enclosure& e) const {
    return every_row(e, [](char* from, char* to) {
      return std::memchr(from, 0, static_cast<std::size_t>(to - from)) == nullptr;
    });
  }
  void mark(const Enclosure& e) {
    (void)every_row(e, [](char* from, char* to) {
      std::fill(from, to, 1);
      return true;
    });
  }
  void mark_at(const PlanePoint& p) { region_.marked[index(p[1], 1) * region_.columns + index(p[0], 0)] = 1; }

 private:
  [[nodiscard]] std::size_t index(double at_m, int k) const {
    const double most = static_cast<double>((k == 0 ? region_.columns : region_.rows) - 2);
    return static_cast<std::size_t>(
        std::clamp(std::floor((at_m - region_.low_m[k]) / region_.cell_m), 1.0, most));
  }
  /// Visits, in each row that the enclosure touches, the cells from the first to the last touched one.
  /// Returns false as soon as `visit` does.
  template <typename Visit>
  bool every_row(const Enclosure& e, Visit visit) const {
    const Corners corners = corners_of(e);
    PlanePoint ends{(*corners.begin())[1], (*corners.begin())[1]};
    for (const PlanePoint& corner : corners)
      ends = {std::min(ends[0], corner[1]), std::max(ends[1], corner[1])};
    const std::size_t last = index(ends[1] + e.rest_m, 1);
    for (std::size_t row = index(ends[0] - e.rest_m, 1); row <= last; ++row) {
      const double row_m = region_.low_m[1] + static_cast<double>(row) * region_.cell_m;
      const PlanePoint span = span_between(corners, std::clamp(row_m - e.rest_m, ends[0], ends[1]),
                                           std::clamp(row_m + region_.cell_m + e.rest_m, ends[0], ends[1]));
      char* cells = region_.marked.data() + row * region_.columns;
      if (!visit(cells + index(span[0] - e.rest_m, 0), cells + index(span[1] + e.rest_m, 0) + 1))
        return false;
    }
    return true;
  }
  /// Returns the least and the greatest x of a convex polygon between two heights that it reaches.
  [[nodiscard]] static PlanePoint span_between(const Corners& corners, double from, double to) {
    PlanePoint span{1e9, -1e9};
    PlanePoint a = *(corners.end() - 1);
    for (const PlanePoint& b : corners) {
      const auto take = [&span](double x) { span = {std::min(span[0], x), std::max(span[1], x)}; };
      if (a[1] >= from && a[1] <= to) take(a[0]);
      for (const double level : {from, to}) {
        if ((a[1] - level) * (b[1] - level) < 0.0)
          take(a[0] + (level - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
      }
      a = b;
    }
    return span;
  }

  ReachRegion& region_;
};

void cover(const JointChain& chain, const DrawnPlane& plane, Marking& marking, double cell_m, JointBox box) {
  const Enclosure e = enclosure_of(chain, plane, box);
  if (marking.holds(e)) return;
  if (e.rest_m < cell_m) return marking.mark(e);
  const std::size_t i = e.curved_joint;
  box.half_q[i] *= 0.5;
  const double centre_q = box.centre_q[i];
  for (const double sign : {-1.0, 1.0}) {
    box.centre_q[i] = centre_q + sign * box.half_q[i];
    cover(chain, plane, marking, cell_m, box);
  }
}

using PlanePoints = std::vector<PlanePoint>;

PlanePoints samples_of(const ArmModel& arm, const DrawnPlane& plane, std::optional<double> joint1_q) {
  PlanePoints samples;
  for (const Vector3& p_m : sample_positions(arm, kInnerSamples, joint1_q)) samples.push_back(plane(p_m));
  return samples;
}

/// Returns empty cells for the samples' extent and a margin. A position beyond them would mark the border.
ReachRegion empty_region(const PlanePoints& samples, double least_cell_m) {
  PlanePoint low = samples.front();
  PlanePoint high = low;
  for (const PlanePoint& p : samples) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  const double side_m = std::max(high[0] - low[0], high[1] - low[1]);
  ReachRegion region;
  region.cell_m = std::max(side_m / static_cast<double>(kReachCells), least_cell_m);
  const double margin_m = kMargin * side_m + 4.0 * region.cell_m;
  region.low_m = {low[0] - margin_m, low[1] - margin_m};
  region.columns = static_cast<std::size_t>(std::ceil((high[0] - low[0] + 2.0 * margin_m) / region.cell_m));
  region.rows = static_cast<std::size_t>(std::ceil((high[1] - low[1] + 2.0 * margin_m) / region.cell_m));
  region.marked.assign(region.columns * region.rows, 0);
  return region;
}

/// Returns the ranges as a box. A range wider than one turn counts as one turn, which has all positions.
JointBox whole_box(const ArmModel& arm, std::optional<double> joint1_q) {
  JointBox all;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const JointLimits& range = arm.joints[i];
    all.centre_q[i] = 0.5 * (range.lower_q + range.upper_q);
    all.half_q[i] = 0.5 * (range.upper_q - range.lower_q);
    if (arm.kinematics.joint_kind(i) == JointKind::kRotary)
      all.half_q[i] = std::min(all.half_q[i], std::numbers::pi);
  }
  if (joint1_q) {
    all.centre_q[0] = *joint1_q;
    all.half_q[0] = 0.0;
  }
  return all;
}

ReachRegion region_of(const ArmModel& arm, const DrawnPlane& plane, std::optional<double> joint1_q,
                      double least_cell_m) {
  const PlanePoints samples = samples_of(arm, plane, joint1_q);
  ReachRegion region = empty_region(samples, least_cell_m);
  Marking marking(region);
  for (const PlanePoint& p : samples) marking.mark_at(p);
  cover(arm.kinematics.chain(), plane, marking, region.cell_m, whole_box(arm, joint1_q));
  return region;
}

/// Returns the region with the neighbours of each cell marked, too.
ReachRegion widened(const ReachRegion& region) {
  ReachRegion wide = region;
  for (std::size_t row = 1; row + 1 < region.rows; ++row) {
    for (std::size_t column = 1; column + 1 < region.columns; ++column) {
      if (!region.at(column, row)) continue;
      for (std::size_t k = row - 1; k <= row + 1; ++k)
        std::fill_n(wide.marked.begin() + static_cast<std::ptrdiff_t>(k * wide.columns + column - 1), 3, 1);
    }
  }
  return wide;
}

/// A turn of all cells about a point, by angles within half_rad.
struct Turn {
  PlanePoint about{};
  double half_rad{};
};

/// Marks the cells on the arc of a point, in steps of half a cell.
void mark_arc(ReachRegion& region, const Turn& turn, const PlanePoint& p) {
  const auto by = [](const PlanePoint& v, double c, double s) {
    return PlanePoint{c * v[0] - s * v[1], s * v[0] + c * v[1]};
  };
  PlanePoint at{p[0] - turn.about[0], p[1] - turn.about[1]};
  const double length_m = 2.0 * turn.half_rad * std::hypot(at[0], at[1]);
  const int steps = static_cast<int>(std::ceil(length_m / (0.5 * region.cell_m))) + 1;
  at = by(at, std::cos(turn.half_rad), -std::sin(turn.half_rad));
  const double c = std::cos(2.0 * turn.half_rad / steps);
  const double s = std::sin(2.0 * turn.half_rad / steps);
  Marking marking(region);
  for (int i = 0; i <= steps; ++i) {
    marking.mark_at({turn.about[0] + at[0], turn.about[1] + at[1]});
    at = by(at, c, s);
  }
}

/// Turns the cells. A reached point is at most half a diagonal from the middle of its cell, and a quarter of
/// a cell from a step. Together that is less than a cell, so the neighbours of the cells on the arcs contain
/// it.
ReachRegion turned(ReachRegion region, const ReachRegion& cells, const Turn& turn) {
  for (std::size_t row = 0; row < cells.rows; ++row) {
    for (std::size_t column = 0; column < cells.columns; ++column) {
      if (!cells.at(column, row)) continue;
      mark_arc(region, turn,
               {cells.low_m[0] + (static_cast<double>(column) + 0.5) * cells.cell_m,
                cells.low_m[1] + (static_cast<double>(row) + 0.5) * cells.cell_m});
    }
  }
  return widened(region);
}

}  // namespace

bool ReachRegion::contains(const PlanePoint& p_m) const {
  const double column = std::floor((p_m[0] - low_m[0]) / cell_m);
  const double row = std::floor((p_m[1] - low_m[1]) / cell_m);
  return column >= 0.0 && row >= 0.0 && column < static_cast<double>(columns) &&
         row < static_cast<double>(rows) &&
         at(static_cast<std::size_t>(column), static_cast<std::size_t>(row));
}

ReachRegion reach_region(const ArmModel& arm, const DrawnPlane& plane, std::optional<double> joint1_q) {
  const JointChain& chain = arm.kinematics.chain();
  const Vector3 axis = rotate(chain.base_T_0.orientation, chain.axes[0].direction);
  const PlanePoint tilt = plane.along(axis);
  const bool turns_in_plane = chain.axes[0].kind == JointKind::kRotary && std::hypot(tilt[0], tilt[1]) < 1e-9;
  if (joint1_q || !turns_in_plane) return region_of(arm, plane, joint1_q, 0.0);
  const ReachRegion empty = empty_region(samples_of(arm, plane, std::nullopt), 0.0);
  const JointBox all = whole_box(arm, std::nullopt);
  const ReachRegion middle = region_of(arm, plane, all.centre_q[0], empty.cell_m);
  const Vector3 through_m =
      chain.base_T_0.position_m + rotate(chain.base_T_0.orientation, chain.axes[0].point_m);
  return turned(empty, middle, {plane(through_m), all.half_q[0]});
}

}  // namespace corbot
