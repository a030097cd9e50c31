// SPDX-License-Identifier: Apache-2.0
#include "cli/plot/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cell/pictures/svg_animate.h"
#include "cli/arm/panel.h"

namespace corbot::cli::charts {
namespace {

using cell::svg_number;
using cell::svg_text;

// Positions in the picture, px.
constexpr double kWidth = 1000.0;
constexpr double kLeft = 74.0;
constexpr double kRight = 834.0;  // the names of the lines are to the right of it
constexpr double kTop = 74.0;
constexpr double kChartTitle = 24.0;
constexpr double kLeastHeight = 100.0;
constexpr double kBetween = 18.0;
constexpr double kAxis = 48.0;
constexpr double kTimeParts = 2.5;
constexpr double kViewWidth = 330.0;
constexpr double kViewHeight = 240.0;
constexpr double kLeastView_m = 0.02;  // a shorter path stays small
constexpr double kLeastStep = 0.5;     // between two points of a path
constexpr double kEntry = 18.0;        // of the names
constexpr std::size_t kColours = 7;
constexpr std::size_t kLabelLetters = 15;

// Colours of Okabe and Ito (2008), which colour-blind readers can distinguish. A dark screen gets the lighter
// ones.
constexpr const char* kStyle =
    "text{font:14px system-ui,sans-serif;fill:#333}.title{font-size:20px;font-weight:600}"
    ".name{font-weight:600}.end{text-anchor:end}.middle{text-anchor:middle}.back{fill:#fff}"
    ".frame,.grid{fill:none;stroke:#ddd}.frame{stroke:#999}.limit{fill:none;stroke:#b00020;stroke-width:1}"
    ".line{fill:none;stroke-width:1.6;stroke-linejoin:round}.dashed{stroke-dasharray:5 4}"
    ".c0{stroke:#0072b2}.c1{stroke:#d55e00}.c2{stroke:#009e73}.c3{stroke:#a8578a}.c4{stroke:#b57d00}"
    ".c5{stroke:#56b4e9}.c6{stroke:#555}"
    "@media (prefers-color-scheme:dark){text{fill:#ddd}.back{fill:#0d1117}.grid{stroke:#30363d}"
    ".frame{stroke:#6e7781}.limit{stroke:#ff7b86}.c0{stroke:#56b4e9}.c1{stroke:#ff9a52}.c2{stroke:#2fc79b}"
    ".c3{stroke:#e39bc3}.c4{stroke:#f0e442}.c5{stroke:#a99cff}.c6{stroke:#aaa}}";

/// A linear scale from values to px.
struct Axis {
  double low, high, low_px, high_px;
  [[nodiscard]] double operator()(double value) const {
    return low_px + (high_px - low_px) * (value - low) / (high - low);
  }
  /// Returns round values within the range, 2 to 5 for each of the `parts` of the axis.
  [[nodiscard]] std::vector<double> ticks(double parts) const {
    std::vector<double> found;
    const double step = round_length((high - low) / (2.0 * parts));
    const auto last = static_cast<long>(std::floor(high / step + 1e-9));
    for (auto i = static_cast<long>(std::ceil(low / step - 1e-9)); i <= last; ++i)
      found.push_back(static_cast<double>(i) * step);
    return found;
  }
};

std::string text_at(const char* style, double x, double y, const std::string& text) {
  return fmt::format("<text class=\"{}\" x=\"{}\" y=\"{}\">{}</text>\n", style, svg_number(x), svg_number(y),
                     svg_text(text));
}

/// The `d` of a path: points to a tenth of a px, each relative to the previous one.
class PathData {
 public:
  void add(double x, double y) {
    const long to_x = std::lround(10.0 * x);
    const long to_y = std::lround(10.0 * y);
    if (is_up_) {
      flush();
      text_ += fmt::format("M{} {}", tenths(to_x), tenths(to_y));
      is_up_ = false;
    } else if (to_y == y_) {
      level_ += to_x - x_;
    } else {
      flush();
      text_ += to_x == x_ ? "v" : fmt::format("l{}{}", tenths(to_x - x_), to_y < y_ ? "" : " ");
      text_ += tenths(to_y - y_);
    }
    x_ = to_x;
    y_ = to_y;
  }
  /// Lifts the pen: the next point begins a line.
  void lift() { is_up_ = true; }
  std::string take() {
    flush();
    return std::move(text_);
  }

 private:
  static std::string tenths(long value) { return svg_number(0.1 * static_cast<double>(value)); }
  void flush() {
    if (level_ != 0) text_ += "h" + tenths(level_);
    level_ = 0;
  }

  std::string text_;
  long x_{}, y_{}, level_{};
  bool is_up_{true};
};

/// The rows of a line in one px column.
struct Column {
  double begin_s{}, end_s{};
  Range range;
};

void draw(PathData& path, const Column& column, const Axis& x, const Axis& y, double& previous) {
  if (column.range.empty()) return path.lift();
  const double at = x(0.5 * (column.begin_s + column.end_s));
  const bool up = std::abs(previous - column.range.low) <= std::abs(previous - column.range.high);
  const double first = up ? column.range.low : column.range.high;
  previous = up ? column.range.high : column.range.low;
  path.add(at, y(first));
  if (previous != first) path.add(at, y(previous));
}

std::string line_path(const ChartLine& line, const ReducedRows& rows, const Axis& x, const Axis& y) {
  PathData path;
  Column column;
  double previous = 0.0;
  long number = -1;
  for (const auto& row : rows.rows()) {
    const auto at = static_cast<long>(x(row.begin_s));
    if (at != number) {
      if (number >= 0) draw(path, column, x, y, previous);
      column = {row.begin_s, row.end_s, {}};
      number = at;
    }
    column.end_s = row.end_s;
    const Range& range = row.ranges[line.series];
    if (range.empty()) continue;
    column.range.add(range.low * line.scale);
    column.range.add(range.high * line.scale);
  }
  if (number >= 0) draw(path, column, x, y, previous);
  return path.take();
}

class Drawing {
 public:
  Drawing(const ChartSheet& sheet, const ReducedRows& rows)
      : sheet_(sheet),
        rows_(rows),
        x_{rows.rows().front().begin_s, rows.rows().back().end_s, kLeft, kRight} {}

  std::string draw() {
    views();
    std::string names;
    for (const Chart& chart : sheet_.charts) {
      if (this->draw(chart)) names += (names.empty() ? "" : "; ") + chart.title;
    }
    for (const double tick : x_.ticks(kTimeParts))
      body_ += text_at("middle", x_(tick), top_ + 2.0, fmt::format("{:.6g}", tick));
    body_ += text_at("middle", 0.5 * (kLeft + kRight), top_ + 24.0, "time, s");
    const std::string head = text_at("title", 20, 32, sheet_.title) + text_at("", 20, 56, sheet_.subtitle);
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 "
        "{0:.0f} "
        "{1:.0f}\" role=\"img\">\n<title>{2}</title>\n<desc>{3}</desc>\n<style>{4}</style>\n"
        "<rect class=\"back\" width=\"100%\" height=\"100%\" rx=\"6\"/>\n{5}{6}</svg>\n",
        kWidth, top_ - kBetween + kAxis, svg_text(sheet_.title), svg_text("Over time: " + names), kStyle,
        head, body_);
  }

 private:
  /// Draws a chart. Returns false if it has no value.
  bool draw(const Chart& chart) {
    std::vector<const ChartLine*> lines;
    Range range;
    for (const ChartLine& line : chart.lines) {
      const Range values = rows_.range(line.series);
      if (values.empty()) continue;
      lines.push_back(&line);
      range.add(values.low * line.scale);
      range.add(values.high * line.scale);
    }
    if (lines.empty()) return false;
    const double middle = 0.5 * (range.low + range.high);
    const double half = 0.55 * std::max(range.high - range.low, chart.least_span);
    const double height =
        std::max(kLeastHeight, kEntry * static_cast<double>(lines.size() + (chart.limits.empty() ? 0 : 1)));
    const double top = top_ + kChartTitle;
    const Axis y{middle - half, middle + half, top + height, top};
    body_ += text_at("name", kLeft, top - 8.0, chart.title);
    grid(x_, y, kTimeParts);
    const bool has_limit = limits(chart, y);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const auto style = fmt::format("line c{}{}", i % kColours, lines[i]->dashed ? " dashed" : "");
      path(style, line_path(*lines[i], rows_, x_, y));
      entry(style, i, top, lines[i]->label);
    }
    if (has_limit) entry("limit", lines.size(), top, "limit");
    top_ = top + height + kBetween;
    return true;
  }

  /// Draws the views beside each other, to one scale.
  void views() {
    if (sheet_.views.empty()) return;
    std::vector<std::array<Range, 2>> ranges(sheet_.views.size());
    double px_per_m = kViewWidth / kLeastView_m;
    for (std::size_t k = 0; k < ranges.size(); ++k) {
      for (const auto& point : sheet_.views[k].points_m) {
        ranges[k][0].add(point[0]);
        ranges[k][1].add(point[1]);
      }
      px_per_m = std::min({px_per_m, 0.9 * kViewWidth / (ranges[k][0].high - ranges[k][0].low),
                           0.9 * kViewHeight / (ranges[k][1].high - ranges[k][1].low)});
    }
    const double top = top_ + kChartTitle;
    for (std::size_t k = 0; k < ranges.size(); ++k) {
      const double left = kLeft + static_cast<double>(k) * (kRight - kLeft - kViewWidth);
      const auto axis = [px_per_m](const Range& range, double from, double to) {
        const double half = 0.5 * std::abs(to - from) / px_per_m;
        const double middle = 0.5 * (range.low + range.high);
        return Axis{middle - half, middle + half, from, to};
      };
      view(sheet_.views[k], axis(ranges[k][0], left, left + kViewWidth),
           axis(ranges[k][1], top + kViewHeight, top));
    }
    top_ = top + kViewHeight + kAxis;
  }

  void view(const PathView& view, const Axis& x, const Axis& y) {
    body_ += text_at("name", x.low_px, y.high_px - 8.0, view.title);
    grid(x, y);
    for (const double tick : x.ticks(1.0))
      body_ += text_at("middle", x(tick), y.low_px + 20.0, fmt::format("{:.6g}", tick));
    PathData data;
    std::array<double, 2> drawn{-1.0, -1.0};
    for (const auto& point : view.points_m) {
      const std::array<double, 2> at{x(point[0]), y(point[1])};
      if (std::hypot(at[0] - drawn[0], at[1] - drawn[1]) < kLeastStep) continue;
      data.add(at[0], at[1]);
      drawn = at;
    }
    path("line c0", data.take());
    const auto& [right_m, up_m] = view.points_m.front();
    body_ += fmt::format("<circle class=\"line c1\" cx=\"{}\" cy=\"{}\" r=\"4\"/>\n", svg_number(x(right_m)),
                         svg_number(y(up_m)));
  }

  void path(const std::string& style, const std::string& d) {
    body_ += fmt::format("<path class=\"{}\" d=\"{}\"/>\n", style, d);
  }

  void grid(const Axis& x, const Axis& y, double parts = 1.0) {
    std::string d;
    for (const double tick : x.ticks(parts))
      d += fmt::format("M{} {}V{}", svg_number(x(tick)), svg_number(y.high_px), svg_number(y.low_px));
    for (const double tick : y.ticks(1.0)) {
      d += fmt::format("M{} {}H{}", svg_number(x.low_px), svg_number(y(tick)), svg_number(x.high_px));
      body_ += text_at("end", x.low_px - 8.0, y(tick) + 5.0, fmt::format("{:.6g}", tick));
    }
    path("grid", d);
    path("frame", fmt::format("M{0} {1}H{2}V{3}H{0}z", svg_number(x.low_px), svg_number(y.high_px),
                              svg_number(x.high_px), svg_number(y.low_px)));
  }

  bool limits(const Chart& chart, const Axis& y) {
    std::string d;
    for (const double limit : chart.limits) {
      if (limit < y.low || limit > y.high) continue;
      d += fmt::format("M{} {}H{}", svg_number(kLeft), svg_number(y(limit)), svg_number(kRight));
    }
    if (!d.empty()) path("limit", d);
    return !d.empty();
  }

  void entry(const std::string& style, std::size_t number, double top, const std::string& label) {
    const double y = top + kEntry * (static_cast<double>(number) + 0.5);
    path(style, fmt::format("M{} {}h24", svg_number(kRight + 10.0), svg_number(y)));
    const bool is_long = label.size() > kLabelLetters;
    body_ += text_at("", kRight + 40.0, y + 5.0, is_long ? label.substr(0, kLabelLetters - 2) + ".." : label);
  }

  const ChartSheet& sheet_;
  const ReducedRows& rows_;
  Axis x_;
  double top_{kTop};
  std::string body_;
};

}  // namespace

std::string chart_svg(const ChartSheet& sheet, const ReducedRows& rows) {
  return Drawing(sheet, rows).draw();
}

}  // namespace corbot::cli::charts
