// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/plot/chart.h"
#include "cli/plot/recording.h"

namespace corbot::cli::charts {

struct PlotOptions {
  std::string record;  ///< a file written by `corbot record`
  std::string output;  ///< "-" = standard output; empty: the record's name with .svg
};

/// Returns the charts of a recording; `name` is the name of its file.
[[nodiscard]] ChartSheet sheet_of(const Recording& recording, const std::string& name);

/// Draws a recording into an SVG file. Throws Failure; the file is then unchanged.
void plot(const PlotOptions& options);

}  // namespace corbot::cli::charts
