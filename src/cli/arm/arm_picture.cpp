// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/arm_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "planner/workspace.h"

namespace corbot::cli {
namespace {

constexpr std::size_t kSamples = 150000;
constexpr int kCells = 120;  // of the larger side of a view
constexpr double kView_px = 460.0;
constexpr double kMargin_px = 50.0;
constexpr double kLetter_px = 6.5;  // of 11 px sans-serif, more than the average one is wide

using Point = std::array<double, 2>;

/// What of the base frame goes to the right and up.
struct View {
  const char* title;
  const char* right_name;
  const char* up_name;
  Vector3 right, up;
  [[nodiscard]] Point operator()(const Vector3& p) const { return {dot(p, right), dot(p, up)}; }
  [[nodiscard]] std::string caption() const {
    return fmt::format("{} ({} to the right, {} up, m)", title, right_name, up_name);
  }
};

struct Box {
  Point low{}, high{};
  void take(const Point& p) {
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
};

/// A step of 1, 2 or 5 that gives five to ten lines.
double grid_step(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length / 5.0)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (length / (factor * power) <= 10.0) return factor * power;
  }
  return 10.0 * power;
}

/// The multiples of step within the range.
std::vector<double> grid_lines(double low, double high, double step) {
  std::vector<double> lines;
  const auto end = static_cast<long>(std::floor((high + 1e-9) / step));
  for (auto i = static_cast<long>(std::ceil(low / step)); i <= end; ++i)
    lines.push_back(static_cast<double>(i) * step);
  return lines;
}

class Drawing {
 public:
  Drawing(const View& view, const Box& box, double px_per_m, double left_px)
      : view_(view), box_(box), scale_(px_per_m), left_px_(left_px) {}

  [[nodiscard]] double x(double right_m) const { return left_px_ + (right_m - box_.low[0]) * scale_; }
  [[nodiscard]] double y(double up_m) const { return kMargin_px + (box_.high[1] - up_m) * scale_; }

  [[nodiscard]] std::string grid() const {
    const double step = grid_step(std::max(box_.high[0] - box_.low[0], box_.high[1] - box_.low[1]));
    std::string text;
    for (const double at : grid_lines(box_.low[0], box_.high[0], step)) {
      text += fmt::format(
          "<path class=\"grid\" d=\"M{0:.1f} {1:.1f}V{2:.1f}\"/><text x=\"{0:.1f}\" "
          "y=\"{3:.1f}\">{4:.3g}</text>\n",
          x(at), y(box_.high[1]), y(box_.low[1]), y(box_.low[1]) + 14, at);
    }
    for (const double at : grid_lines(box_.low[1], box_.high[1], step)) {
      text += fmt::format(
          "<path class=\"grid\" d=\"M{0:.1f} {1:.1f}H{2:.1f}\"/><text class=\"left\" x=\"{3:.1f}\" "
          "y=\"{1:.1f}\">{4:.3g}</text>\n",
          x(box_.low[0]), y(at), x(box_.high[0]), x(box_.low[0]) - 5, at);
    }
    return text + fmt::format("<text class=\"caption\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x(box_.low[0]),
                              kMargin_px - 16, view_.caption());
  }

  /// Cells that a sample fell into, runs of a row as one rectangle; a cell between two is taken to be reached, too.
  [[nodiscard]] std::string reach(const std::vector<Vector3>& samples) const {
    const double cell = std::max(box_.high[0] - box_.low[0], box_.high[1] - box_.low[1]) / kCells;
    const std::size_t last = kCells - 1;
    std::vector<std::vector<char>> hit(kCells, std::vector<char>(kCells, 0));
    for (const Vector3& sample : samples) {
      const Point p = view_(sample);
      const auto i = static_cast<std::size_t>((p[0] - box_.low[0]) / cell);
      const auto k = static_cast<std::size_t>((p[1] - box_.low[1]) / cell);
      hit[std::min(k, last)][std::min(i, last)] = 1;
    }
    std::string text;
    for (std::size_t k = 0; k < hit.size(); ++k) {
      for (std::size_t i = 1; i + 1 < hit[k].size(); ++i)
        if (hit[k][i - 1] == 1 && hit[k][i + 1] != 0) hit[k][i] |= 2;
      for (std::size_t i = 0; i < hit[k].size();) {
        std::size_t end = i;
        while (end < hit[k].size() && hit[k][end] != 0) ++end;
        if (end > i) {
          text += fmt::format("M{:.1f} {:.1f}h{:.1f}v{:.1f}h{:.1f}z",
                              x(box_.low[0] + static_cast<double>(i) * cell),
                              y(box_.low[1] + static_cast<double>(k + 1) * cell),
                              static_cast<double>(end - i) * cell * scale_, cell * scale_,
                              -static_cast<double>(end - i) * cell * scale_);
        }
        i = end + 1;
      }
    }
    return fmt::format("<path class=\"reach\" d=\"{}\"/>\n", text);
  }

  [[nodiscard]] std::string arm(const std::vector<Vector3>& line) const {
    std::string points, dots;
    for (const Vector3& at : line) {
      const Point p = view_(at);
      points += fmt::format("{:.1f},{:.1f} ", x(p[0]), y(p[1]));
      dots += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>", x(p[0]), y(p[1]));
    }
    return fmt::format("<polyline class=\"arm\" points=\"{}\"/>{}\n", points, dots);
  }

 private:
  const View& view_;
  const Box& box_;
  double scale_, left_px_;
};

/// The horizontal direction in which the arm stands, from axis 1 to its tool.
View side_view(const Workspace& space, const std::vector<Vector3>& line) {
  View view{"from the side", "x", "z", {1, 0, 0}, {0, 0, 1}};
  if (!space.about_axis) return view;
  const Vector3 away = line.back() - space.axis_m;
  const double length = std::hypot(away[0], away[1]);
  view.right_name = "away from axis 1 in the arm's direction";
  if (length > 1e-3) view.right = {away[0] / length, away[1] / length, 0.0};
  return view;
}

}  // namespace

std::vector<Vector3> arm_line(const Kinematics& arm, const Joints& q) {
  const JointChain& chain = arm.chain();
  Pose pose = chain.base_T_0;
  std::vector<Vector3> line{pose.position_m};
  for (std::size_t i = 0; i < chain.count; ++i) {
    const JointAxis& axis = chain.axes[i];
    const Vector3 direction = rotate(pose.orientation, axis.direction);
    if (axis.kind == JointKind::kRotary) {
      const Vector3 point = pose.position_m + rotate(pose.orientation, axis.point_m);
      const Vector3 on_axis = point + dot(line.back() - point, direction) * direction;
      // Next to the one before, but for a first axis through the base: its link goes up to the axis's own point.
      line.push_back(norm(on_axis - line.back()) > 1e-9 ? on_axis : point);
    } else if (q[i] != 0.0) {
      line.push_back(line.back() + q[i] * direction);
    }
    pose = pose * displacement(axis, q[i]);
  }
  const Pose flange = pose * chain.zero_T_n;
  line.push_back(flange.position_m);
  line.push_back((flange * chain.n_T_tool).position_m);
  return line;
}

std::string arm_picture(const Profile& profile, const Joints& q) {
  const ArmModel& arm = profile.arm;
  const Workspace space = workspace_of(arm);
  const std::vector<Vector3> line = arm_line(arm.kinematics, q);
  const std::array<View, 2> views{side_view(space, line), View{"from above", "x", "y", {1, 0, 0}, {0, 1, 0}}};
  const std::array<std::vector<Vector3>, 2> samples{
      sample_positions(arm, kSamples, space.about_axis ? std::optional(q[0]) : std::nullopt),
      sample_positions(arm, kSamples, std::nullopt)};
  std::array<Box, 2> boxes;
  double most_m = 1e-3;
  for (std::size_t k = 0; k < 2; ++k) {
    for (const Vector3& at : samples[k]) boxes[k].take(views[k](at));
    for (const Vector3& at : line) boxes[k].take(views[k](at));
    most_m = std::max({most_m, boxes[k].high[0] - boxes[k].low[0], boxes[k].high[1] - boxes[k].low[1]});
  }
  const double scale = kView_px / most_m;
  std::string body;
  double left_px = kMargin_px;
  double height_px = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    const Drawing drawing(views[k], boxes[k], scale, left_px);
    body += drawing.reach(samples[k]) + drawing.grid() + drawing.arm(line);
    const double caption_px = kLetter_px * static_cast<double>(views[k].caption().size());
    left_px += std::max((boxes[k].high[0] - boxes[k].low[0]) * scale, caption_px) + 2 * kMargin_px;
    height_px = std::max(height_px, (boxes[k].high[1] - boxes[k].low[1]) * scale);
  }
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
      "{1:.0f}\">\n"
      "<title>{2}: the arm and its reach</title>\n"
      "<style>text{{font:11px "
      "sans-serif;text-anchor:middle;fill:#444}}.left{{text-anchor:end}}.caption{{text-anchor:start}}.grid{{"
      "stroke:#bbb;stroke-width:.5}}"
      ".reach{{fill:#9ec5e8}}.arm{{fill:none;stroke:#c03020;stroke-width:5;stroke-linejoin:round}}circle{{"
      "fill:#301008}}</style>\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{3}</svg>\n",
      left_px - kMargin_px + 20, height_px + 2 * kMargin_px, profile.name, body);
}

}  // namespace corbot::cli
