// SPDX-License-Identifier: Apache-2.0
#include "cli/plot/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "client/explain.h"
#include "client/failure.h"
#include "client/write_file.h"

namespace corbot::cli::charts {
namespace {

namespace fs = std::filesystem;
using client::ExitCode;
using client::Failure;

/// Returns text such as "2 elbow".
std::string label_of(const Recording& recording, std::size_t joint) {
  const std::string& name = recording.joints[joint].name;
  return fmt::format("{}{}{}", joint, name.empty() ? "" : " ", name);
}

Chart set_points(const Recording& recording, std::size_t i) {
  const RecordedJoint& joint = recording.joints[i];
  Chart chart{fmt::format("joint {}, {}", label_of(recording, i), joint.unit()),
              {{"set-point", Recording::series_of(i, Quantity::kSetPoint)},
               {"measured", Recording::series_of(i, Quantity::kMeasured), 1.0, true}},
              {},
              joint.kind == JointKind::kRotary ? 0.1 : 0.001};
  if (joint.limits) chart.limits = {joint.limits->lower, joint.limits->upper};
  return chart;
}

/// Adds a quantity of every joint with the limit `limit`, as a share of that limit. Rotary and sliding, fast
/// and slow joints thus share a chart. Without limits each unit has a chart.
void add_rates(std::vector<Chart>& charts, const Recording& recording, const char* name, Quantity quantity,
               double RecordedLimits::*limit, const char* per_time) {
  const bool has_limits =
      std::all_of(recording.joints.begin(), recording.joints.end(),
                  [limit](const RecordedJoint& joint) { return joint.limits && (*joint.limits).*limit > 0; });
  if (has_limits) {
    Chart chart{fmt::format("{}, % of the limit", name), {}, {-100.0, 100.0}, 1.0};
    for (std::size_t i = 0; i < recording.joints.size(); ++i) {
      chart.lines.push_back({label_of(recording, i), Recording::series_of(i, quantity),
                             100.0 / ((*recording.joints[i].limits).*limit)});
    }
    charts.push_back(std::move(chart));
    return;
  }
  for (const JointKind kind : {JointKind::kRotary, JointKind::kPrismatic}) {
    const bool turns = kind == JointKind::kRotary;
    Chart chart{fmt::format("{}, {}/{}", name, turns ? "deg" : "m", per_time), {}, {}, turns ? 0.1 : 0.001};
    for (std::size_t i = 0; i < recording.joints.size(); ++i) {
      if (recording.joints[i].kind == kind)
        chart.lines.push_back({label_of(recording, i), Recording::series_of(i, quantity)});
    }
    charts.push_back(std::move(chart));
  }
}

Chart pulses(const Recording& recording) {
  Chart chart{"pulses, us", {}, {}, 10.0};
  for (std::size_t i = 0; i < recording.joints.size(); ++i)
    chart.lines.push_back({label_of(recording, i), Recording::series_of(i, Quantity::kPulse)});
  chart.lines.push_back({"gripper", recording.gripper_pulse()});
  return chart;
}

/// Returns text such as ", 2 late by up to 17 ms", or "" without a late cycle.
std::string late_text(const Recording& recording) {
  if (recording.late == 0) return "";
  return fmt::format(", {} late by up to {:.4g} ms", recording.late, 1e3 * recording.latest_s);
}

bool is_same_file(const std::string& one, const std::string& other) {
  std::error_code error;
  return fs::equivalent(one, other, error);
}

}  // namespace

ChartSheet sheet_of(const Recording& recording, const std::string& name) {
  const std::string profile =
      recording.profile.empty() ? "" : fmt::format("profile '{}', ", recording.profile);
  ChartSheet sheet{client::printable(name),
                   fmt::format("{}{:.6g} s, {} cycles, {} missing{}", profile, recording.duration_s(),
                               recording.cycles, recording.missing, late_text(recording)),
                   {}};
  for (std::size_t i = 0; i < recording.joints.size(); ++i) sheet.charts.push_back(set_points(recording, i));
  add_rates(sheet.charts, recording, "speed of the set-points", Quantity::kSpeed, &RecordedLimits::speed,
            "s");
  add_rates(sheet.charts, recording, "acceleration of the set-points", Quantity::kAcceleration,
            &RecordedLimits::acceleration, "s2");
  add_rates(sheet.charts, recording, "jerk of the set-points", Quantity::kJerk, &RecordedLimits::jerk, "s3");
  sheet.charts.push_back(pulses(recording));
  return sheet;
}

void plot(const PlotOptions& options) {
  const std::string output =
      options.output.empty() ? fs::path(options.record).replace_extension(".svg").string() : options.output;
  if (is_same_file(options.record, output))
    throw Failure(ExitCode::kUsage, output + " is the record: name another file with --output");
  const Recording recording = read_recording(options.record);
  const std::string svg =
      chart_svg(sheet_of(recording, fs::path(options.record).filename().string()), recording.rows);
  if (output == "-") {
    fmt::print("{}", svg);
    return;
  }
  client::write_file(output, svg);
  fmt::print("{}\n", output);
}

}  // namespace corbot::cli::charts
