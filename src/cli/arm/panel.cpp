// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace corbot::cli {
namespace {

constexpr double kCorner_cos = 0.94;  // between a tangent and its chord; a smaller one is a corner
constexpr double kMargin = 0.06;      // of the larger side: space for the foot and for symbols
constexpr double kNumbers_px = 44.0;  // least distance between two numbered lines

/// Returns the multiples of `step` within the range.
std::vector<double> multiples(double low, double high, double step) {
  std::vector<double> found;
  const auto end = static_cast<long>(std::floor(high / step + 1e-9));
  for (auto i = static_cast<long>(std::ceil(low / step - 1e-9)); i <= end; ++i)
    found.push_back(static_cast<double>(i) * step);
  return found;
}

double distance(const PlanePoint& from, const PlanePoint& to) {
  return std::hypot(to[0] - from[0], to[1] - from[1]);
}

/// Returns the direction, of length 1.
PlanePoint direction(const PlanePoint& from, const PlanePoint& to) {
  const double length = std::max(distance(from, to), 1e-9);
  return {(to[0] - from[0]) / length, (to[1] - from[1]) / length};
}

/// Returns a closed path of Bezier curves. The tangent at a point is parallel to the chord of its neighbours,
/// unless the point is a corner.
std::string curve_through(const Outline& points) {
  const std::size_t count = points.size();
  std::string path = fmt::format("M{:.1f} {:.1f}", points[0][0], points[0][1]);
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = [&](std::size_t k) { return points[(i + count + k - 1) % count]; };
    const PlanePoint chord = direction(at(1), at(2));
    const auto tangent = [&chord](const PlanePoint& before, const PlanePoint& after) {
      const PlanePoint t = direction(before, after);
      return chord[0] * t[0] + chord[1] * t[1] > kCorner_cos ? t : chord;
    };
    const PlanePoint start = tangent(at(0), at(2));
    const PlanePoint end = tangent(at(1), at(3));
    // The handle is no longer than the shorter neighbour allows, or a long straight line would bulge.
    const double first = std::min(distance(at(0), at(1)), distance(at(1), at(2))) / 3.0;
    const double second = std::min(distance(at(1), at(2)), distance(at(2), at(3))) / 3.0;
    path += fmt::format("C{:.1f} {:.1f} {:.1f} {:.1f} {:.1f} {:.1f}", at(1)[0] + first * start[0],
                        at(1)[1] + first * start[1], at(2)[0] - second * end[0], at(2)[1] - second * end[1],
                        at(2)[0], at(2)[1]);
  }
  return path + "z";
}

/// Returns the part of a convex polygon where dot(normal, p) <= offset.
Outline cut(const Outline& polygon, const PlanePoint& normal, double offset_m) {
  const auto beyond_m = [&](const PlanePoint& p) { return normal[0] * p[0] + normal[1] * p[1] - offset_m; };
  Outline kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const PlanePoint &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
    const double from_m = beyond_m(from), to_m = beyond_m(to);
    if (from_m <= 0.0) kept.push_back(from);
    if ((from_m <= 0.0) == (to_m <= 0.0)) continue;
    const double share = from_m / (from_m - to_m);
    kept.push_back({from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])});
  }
  return kept;
}

}  // namespace

double round_length(double most_m) {
  const double power = std::pow(10.0, std::floor(std::log10(most_m)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= most_m) return factor * power;
  }
  return power;
}

std::string joint_symbol(JointKind kind, double x, double y, double radius) {
  if (kind == JointKind::kRotary)
    return fmt::format("<circle class=\"joint\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"/>", x, y, radius);
  return fmt::format("<rect class=\"joint\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>",
                     x - radius, y - radius, 2.0 * radius, 2.0 * radius);
}

std::string tool_symbol(double x, double y, double radius) {
  return fmt::format(
      "<path class=\"tool\" d=\"M{0:.1f} {1:.1f}l{2:.1f} {2:.1f}l-{2:.1f} {2:.1f}l-{2:.1f} -{2:.1f}z\"/>", x,
      y - radius, radius);
}

Panel::Panel(const DrawnPlane& plane, const ReachRegion& reach, const ArmLine& arm)
    : plane_(plane),
      outlines_(outlines_of(reach)),
      arm_(arm),
      low_m_(plane(arm.points_m[0])),
      high_m_(low_m_) {
  const auto take = [this](const PlanePoint& p) {
    for (std::size_t k = 0; k < 2; ++k) {
      low_m_[k] = std::min(low_m_[k], p[k]);
      high_m_[k] = std::max(high_m_[k], p[k]);
    }
  };
  for (const Outline& outline : outlines_) std::for_each(outline.begin(), outline.end(), take);
  for (const Vector3& at : arm_.points_m) take(plane_(at));
  const double margin_m = kMargin * std::max({width_m(), height_m(), 1e-3});
  low_m_ = {low_m_[0] - margin_m, low_m_[1] - margin_m};
  high_m_ = {high_m_[0] + margin_m, high_m_[1] + margin_m};
}

void Panel::place(double left, double top, double px_per_m) {
  left_ = left;
  top_ = top;
  px_per_m_ = px_per_m;
}

std::string Panel::grid() const {
  const double step_m = 2.0 * kNumbers_px / px_per_m_;
  const double round_m = round_length(step_m);
  std::string lines, numbers;
  for (const double at_m : multiples(low_m_[0], high_m_[0], round_m)) {
    lines += fmt::format("M{:.1f} {:.1f}V{:.1f}", x(at_m), top_, bottom());
    numbers += fmt::format("<text class=\"middle\" x=\"{:.1f}\" y=\"{:.1f}\">{:.3g}</text>", x(at_m),
                           bottom() + 22.0, at_m);
  }
  for (const double at_m : multiples(low_m_[1], high_m_[1], round_m)) {
    lines += fmt::format("M{:.1f} {:.1f}H{:.1f}", left_, y(at_m), right());
    numbers += fmt::format("<text class=\"end\" x=\"{:.1f}\" y=\"{:.1f}\">{:.3g}</text>", left_ - 7.0,
                           y(at_m) + 5.0, at_m);
  }
  return fmt::format("<path class=\"grid\" d=\"{}\"/>\n{}\n", lines, numbers);
}

std::string Panel::reach() const {
  std::string path;
  for (const Outline& outline : outlines_) {
    Outline drawn;
    for (const PlanePoint& p : outline) drawn.push_back({x(p[0]), y(p[1])});
    path += curve_through(drawn);
  }
  return fmt::format("<path class=\"reach\" d=\"{}\"/>\n", path);
}

std::string Panel::polygon(const Outline& corners_m) const {
  std::string path;
  for (const PlanePoint& p : corners_m)
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', x(p[0]), y(p[1]));
  return path.empty() ? path : path + "z";
}

std::string Panel::forbidden(const WorkspaceLimits& limits) const {
  constexpr double kAlongView = 1e-9;
  const Outline all{low_m_, {high_m_[0], low_m_[1]}, high_m_, {low_m_[0], high_m_[1]}};
  std::string drawn;
  for (std::size_t k = 0; k < limits.count; ++k) {
    const WorkspaceShape& shape = limits.shapes[k];
    const bool is_inside = shape.kind == ShapeKind::kInside;
    const double sign = is_inside ? -1.0 : 1.0;  // the inner polygon is allowed, or forbidden
    Outline inner = all;
    bool has_face = false;
    for (std::size_t i = 0; i < shape.face_count; ++i) {
      const HalfSpace& face = shape.faces[i];
      const PlanePoint normal = plane_.along(sign * face.normal);
      if (std::hypot(normal[0], normal[1]) < kAlongView) continue;
      has_face = true;
      inner = cut(inner, normal, sign * (face.offset_m - dot(face.normal, plane_.origin_m)));
    }
    if (!has_face || (inner.empty() && !is_inside)) continue;
    drawn += fmt::format("<path class=\"forbidden\" d=\"{}{}\"/>\n", is_inside ? polygon(all) : "",
                         polygon(inner));
  }
  return drawn;
}

std::string Panel::foot(double width) const {
  const PlanePoint base = plane_(arm_.points_m.front());
  return fmt::format("<rect class=\"foot\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
                     x(base[0]) - 0.5 * width, y(base[1]), width, 0.25 * width);
}

std::string Panel::arm(double joint_radius) const {
  std::string points, symbols;
  for (const Vector3& at : arm_.points_m)
    points += fmt::format("{:.1f},{:.1f} ", x(plane_(at)[0]), y(plane_(at)[1]));
  for (const ArmLine::Joint& joint : arm_.joints) {
    const PlanePoint at = plane_(joint.at_m);
    symbols += joint_symbol(joint.kind, x(at[0]), y(at[1]), joint_radius);
  }
  const PlanePoint tool = plane_(arm_.points_m.back());
  symbols += tool_symbol(x(tool[0]), y(tool[1]), joint_radius + 1.0);
  points.pop_back();
  return fmt::format(
      "<polyline class=\"halo\" points=\"{0}\"/><polyline class=\"arm\" points=\"{0}\"/>\n{1}\n", points,
      symbols);
}

}  // namespace corbot::cli
