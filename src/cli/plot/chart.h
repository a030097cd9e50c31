// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "cli/plot/reduced_rows.h"

namespace corbot::cli::charts {

/// A line of a chart: a series of the rows, times `scale`.
struct ChartLine {
  std::string label;
  std::size_t series{};
  double scale{1.0};
  bool dashed{false};
};

struct Chart {
  std::string title;  ///< with the unit
  std::vector<ChartLine> lines;
  std::vector<double> limits;  ///< drawn if they are within the chart
  double least_span{1.0};      ///< least height of the chart, used if the values differ less
};

/// A path in a plane, in m; all views have one scale. A ring marks the beginning of the path.
struct PathView {
  std::string title;
  std::vector<std::array<double, 2>> points_m;
};

/// Charts below each other, over one time axis in seconds from the first row on. Views, at most two, are
/// above them.
struct ChartSheet {
  std::string title;
  std::string subtitle;
  std::vector<Chart> charts;
  std::vector<PathView> views{};
};

/// Returns an SVG without a script, 1000 px wide, which adapts to a dark screen. A line has at most two
/// points in each px column: its extremes. Lines without a value and charts without a line are omitted.
[[nodiscard]] std::string chart_svg(const ChartSheet& sheet, const ReducedRows& rows);

}  // namespace corbot::cli::charts
