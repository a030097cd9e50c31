// SPDX-License-Identifier: Apache-2.0
#include "planner/reach_region.h"

#include <algorithm>
#include <cmath>

#include "planner/workspace.h"

namespace corbot {
namespace {

constexpr std::size_t kSamples = 100000;  // they mark the inside, so that only boxes at the outline are halved
constexpr double kMargin = 0.1;           // of the samples' extent: what lies beyond them

/// Joint values from centre - half to centre + half.
struct JointBox {
  Joints centre_q{}, half_q{};
};

/// Holds the projection of a box: centre + the sum of t·side for t in [-1, 1], and everything within rest_m of that.
struct Enclosure {
  PlanePoint centre{};
  std::array<PlanePoint, kMaxJoints> sides{};
  double rest_m{};
  std::size_t curved_joint{};  ///< contributes most to rest_m
};

/// Taylor's theorem about the box's centre. The second derivative by joints i <= j is a_i x (a_j x r_j) where both turn, so at most the
/// tool's distance from axis j; a_i x a_j, at most 1, where j slides; 0 where i slides.
Enclosure enclosure_of(const JointChain& chain, const DrawnPlane& plane, const JointBox& box) {
  Enclosure e;
  const Pose tool = forward(chain, box.centre_q);
  const Jacobian j = jacobian(chain, box.centre_q);
  e.centre = plane(tool.position_m);
  // How fast joint i moves the tool: its speed at the centre, and what the joints further out may change of that distance.
  std::array<double, kMaxJoints> speed{};
  double outer_m = 0.0;
  for (std::size_t i = chain.count; i-- > 0;) {
    const Vector3 column{j[0][i], j[1][i], j[2][i]};
    const PlanePoint p = plane(column);
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
  for (const double share : share_m) e.rest_m += share;
  e.curved_joint = static_cast<std::size_t>(std::max_element(share_m.begin(), share_m.end()) - share_m.begin());
  return e;
}

/// The corners of centre + the sum of t·side, in order: a polygon with two edges a side.
std::vector<PlanePoint> corners_of(const Enclosure& e) {
  std::vector<PlanePoint> sides;
  PlanePoint at = e.centre;
  for (PlanePoint side : e.sides) {
    if (side[0] == 0.0 && side[1] == 0.0) continue;
    if (side[1] < 0.0 || (side[1] == 0.0 && side[0] < 0.0)) side = {-side[0], -side[1]};
    at = {at[0] - side[0], at[1] - side[1]};
    sides.push_back(side);
  }
  std::sort(sides.begin(), sides.end(),
            [](const PlanePoint& a, const PlanePoint& b) { return a[0] * b[1] - a[1] * b[0] > 0.0; });
  std::vector<PlanePoint> corners{at};
  for (const double sign : {2.0, -2.0}) {
    for (const PlanePoint& side : sides) {
      at = {at[0] + sign * side[0], at[1] + sign * side[1]};
      corners.push_back(at);
    }
  }
  return corners;
}

class Marking {
 public:
  explicit Marking(ReachRegion& region) : region_(region) {}

  [[nodiscard]] bool holds(const Enclosure& e) const {
    return every_row(e, [](char* from, char* to) { return std::all_of(from, to, [](char c) { return c != 0; }); });
  }
  void mark(const Enclosure& e) {
    (void)every_row(e, [](char* from, char* to) {
      std::fill(from, to, 1);
      return true;
    });
  }

 private:
  [[nodiscard]] std::size_t index(double at_m, int k) const {
    const double most = static_cast<double>((k == 0 ? region_.columns : region_.rows) - 2);
    return static_cast<std::size_t>(std::clamp(std::floor((at_m - region_.low_m[k]) / region_.cell_m), 1.0, most));
  }
  /// Of each row that the enclosure touches, the cells from the first to the last that it touches, until one is refused.
  template <typename Visit>
  bool every_row(const Enclosure& e, Visit visit) const {
    const std::vector<PlanePoint> corners = corners_of(e);
    PlanePoint ends{corners[0][1], corners[0][1]};
    for (const PlanePoint& corner : corners) ends = {std::min(ends[0], corner[1]), std::max(ends[1], corner[1])};
    const std::size_t last = index(ends[1] + e.rest_m, 1);
    for (std::size_t row = index(ends[0] - e.rest_m, 1); row <= last; ++row) {
      const double row_m = region_.low_m[1] + static_cast<double>(row) * region_.cell_m;
      const PlanePoint span = span_between(corners, std::clamp(row_m - e.rest_m, ends[0], ends[1]),
                                           std::clamp(row_m + region_.cell_m + e.rest_m, ends[0], ends[1]));
      char* cells = region_.marked.data() + row * region_.columns;
      if (!visit(cells + index(span[0] - e.rest_m, 0), cells + index(span[1] + e.rest_m, 0) + 1)) return false;
    }
    return true;
  }
  /// Leftmost and rightmost of a convex polygon between two heights, of which it has points.
  [[nodiscard]] static PlanePoint span_between(const std::vector<PlanePoint>& corners, double from, double to) {
    PlanePoint span{1e9, -1e9};
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const PlanePoint& a = corners[i];
      const PlanePoint& b = corners[(i + 1) % corners.size()];
      const auto take = [&span](double x) { span = {std::min(span[0], x), std::max(span[1], x)}; };
      if (a[1] >= from && a[1] <= to) take(a[0]);
      for (const double level : {from, to}) {
        if ((a[1] - level) * (b[1] - level) < 0.0) take(a[0] + (level - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
      }
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

/// Empty cells for what the samples reach and a margin; what were still beyond would be marked at the border.
ReachRegion empty_region(const std::vector<PlanePoint>& samples) {
  PlanePoint low = samples.front();
  PlanePoint high = low;
  for (const PlanePoint& p : samples) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  const double side_m = std::max({high[0] - low[0], high[1] - low[1], 1e-3});
  const double margin_m = kMargin * side_m;
  ReachRegion region;
  region.cell_m = side_m / static_cast<double>(kReachCells);
  region.low_m = {low[0] - margin_m, low[1] - margin_m};
  region.columns = static_cast<std::size_t>(std::ceil((high[0] - low[0] + 2.0 * margin_m) / region.cell_m));
  region.rows = static_cast<std::size_t>(std::ceil((high[1] - low[1] + 2.0 * margin_m) / region.cell_m));
  region.marked.assign(region.columns * region.rows, 0);
  return region;
}

}  // namespace

bool ReachRegion::contains(const PlanePoint& p_m) const {
  const double column = std::floor((p_m[0] - low_m[0]) / cell_m);
  const double row = std::floor((p_m[1] - low_m[1]) / cell_m);
  return column >= 0.0 && row >= 0.0 && column < static_cast<double>(columns) && row < static_cast<double>(rows) &&
         at(static_cast<std::size_t>(column), static_cast<std::size_t>(row));
}

ReachRegion reach_region(const ArmModel& arm, const DrawnPlane& plane, std::optional<double> joint1_q) {
  std::vector<PlanePoint> samples;
  for (const Vector3& p_m : sample_positions(arm, kSamples, joint1_q)) samples.push_back(plane(p_m));
  ReachRegion region = empty_region(samples);
  Marking marking(region);
  for (const PlanePoint& p : samples) marking.mark(Enclosure{p, {}, 0.0, 0});
  JointBox all;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    all.centre_q[i] = 0.5 * (arm.joints[i].lower_q + arm.joints[i].upper_q);
    all.half_q[i] = 0.5 * (arm.joints[i].upper_q - arm.joints[i].lower_q);
  }
  if (joint1_q) {
    all.centre_q[0] = *joint1_q;
    all.half_q[0] = 0.0;
  }
  cover(arm.kinematics.chain(), plane, marking, region.cell_m, all);
  return region;
}

}  // namespace corbot
