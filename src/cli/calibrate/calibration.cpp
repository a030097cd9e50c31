// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "corbot/units.h"

namespace corbot::cli {

namespace {

/// Marks that are closer turn the error of reading an angle into an error of the scale.
constexpr double kLeastAngle_deg = 10.0;
constexpr double kLeastPulse_us = 50.0;
/// Hobby servos have about 10 us a degree; gears and linkages change that, within these bounds.
constexpr double kScaleMin = 2.0;
constexpr double kScaleMax = 60.0;
constexpr double kPulseTolerance_us = 1e-6;
constexpr double kWidestAngle_deg = 180.0;

double rounded(double value, double steps) { return std::round(value * steps) / steps; }

/// Inwards, so that the end can be reached.
double rounded_end(double angle_deg, bool upper) {
  constexpr double kSteps = 10.0;
  return (upper ? std::floor(angle_deg * kSteps) : std::ceil(angle_deg * kSteps)) / kSteps + 0.0;
}

}  // namespace

LineResult line_through(const Mark& a, const Mark& b) {
  const double angle_deg = b.angle_deg - a.angle_deg;
  const double pulse_us = b.pulse_us - a.pulse_us;
  if (std::abs(angle_deg) < kLeastAngle_deg || std::abs(pulse_us) < kLeastPulse_us) {
    return {std::nullopt,
            fmt::format("the marks are {:.4g} degrees and {:.4g} us apart: too close; at least {:g} degrees "
                        "and {:g} us, better 90 degrees",
                        std::abs(angle_deg), std::abs(pulse_us), kLeastAngle_deg, kLeastPulse_us)};
  }
  const double slope = pulse_us / angle_deg;
  ServoLine line;
  line.direction = slope > 0.0 ? 1 : -1;
  line.us_per_degree = rounded(std::abs(slope), 1e3);
  // Through the middle of both, so that the rounding error of the scale is equal at either.
  const double middle_deg = 0.5 * (a.angle_deg + b.angle_deg);
  line.zero_us =
      rounded(0.5 * (a.pulse_us + b.pulse_us) - line.direction * line.us_per_degree * middle_deg, 1e2);
  if (line.us_per_degree < kScaleMin || line.us_per_degree > kScaleMax) {
    return {std::nullopt,
            fmt::format("{:.4g} us a degree is not plausible ({:g} to {:g}): look at both angles",
                        line.us_per_degree, kScaleMin, kScaleMax)};
  }
  return {line, ""};
}

Calibration::Calibration(const Profile& profile)
    : closed_us_(profile.arm.gripper.closed_us), open_us_(profile.arm.gripper.open_us) {
  profile_gripper_us_ = {closed_us_, open_us_};
  for (std::size_t i = 0; i < profile.arm.dof; ++i) {
    const ServoMap& map = profile.arm.servos[i];
    const JointLimits& limits = profile.arm.joints[i];
    Joint joint;
    joint.name = profile.joint_names[i];
    joint.line = {map.zero_us, rounded(map.us_per_q * kRadiansPerDegree, 1e9), map.direction > 0.0 ? 1 : -1};
    joint.range_deg = {rounded(to_degrees(limits.lower_q), 1e9), rounded(to_degrees(limits.upper_q), 1e9)};
    joint.pulse_range_us = {map.pulse_min_us, map.pulse_max_us};
    joints_.push_back(std::move(joint));
  }
}

ServoLine Calibration::line(std::size_t joint) const {
  const Joint& it = joints_[joint];
  if (it.marks.size() == 2) {
    if (const auto result = line_through(it.marks[0], it.marks[1]); result.line) return *result.line;
  }
  ServoLine line = it.line;
  if (it.marks.empty()) return line;
  const Mark& mark = it.marks.back();
  line.zero_us = rounded(mark.pulse_us - line.direction * line.us_per_degree * mark.angle_deg, 1e2);
  return line;
}

std::array<double, 2> Calibration::range_deg(std::size_t joint) const {
  const Joint& it = joints_[joint];
  std::array<double, 2> range = it.range_deg;
  for (const bool upper : {false, true}) {
    if (const auto pulse_us = it.limit_us[upper ? 1 : 0])
      range[upper ? 1 : 0] = rounded_end(line(joint).angle_deg(*pulse_us), upper);
  }
  return range;
}

void Calibration::remember() { before_.push_back({joints_, closed_us_, open_us_}); }

std::string Calibration::mark(std::size_t joint, const Mark& mark) {
  if (!(std::abs(mark.angle_deg) <= kWidestAngle_deg)) return "an angle of -180 to 180 degrees";
  std::vector<Mark> marks = joints_[joint].marks;
  const auto same = std::find_if(marks.begin(), marks.end(),
                                 [&](const Mark& other) { return other.angle_deg == mark.angle_deg; });
  if (same != marks.end()) marks.erase(same);  // the newer measurement counts
  if (marks.size() == 2) marks.erase(marks.begin());
  marks.push_back(mark);
  if (marks.size() == 2) {
    if (const auto result = line_through(marks[0], marks[1]); !result.line) return result.fault;
  }
  remember();
  joints_[joint].marks = std::move(marks);
  return "";
}

std::string Calibration::limit(std::size_t joint, bool upper, double pulse_us) {
  const double angle_deg = line(joint).angle_deg(pulse_us);
  const char* const name = upper ? "high" : "low";
  if (std::abs(angle_deg) > kWidestAngle_deg)
    return fmt::format("{:.1f} degrees is further than half a turn", angle_deg);
  if (upper ? angle_deg < 0.0 : angle_deg > 0.0) {
    return fmt::format("the {} end would be at {:.1f} degrees; 0, where Ready goes, must be in the range",
                       name, angle_deg);
  }
  remember();
  joints_[joint].limit_us[upper ? 1 : 0] = pulse_us;
  return "";
}

void Calibration::mark_gripper(bool open, double pulse_us) {
  remember();
  (open ? open_us_ : closed_us_) = rounded(pulse_us, 1e2);
}

bool Calibration::undo() {
  if (before_.empty()) return false;
  State& last = before_.back();
  joints_ = std::move(last.joints);
  closed_us_ = last.closed_us;
  open_us_ = last.open_us;
  before_.pop_back();
  return true;
}

std::vector<std::string> Calibration::faults() const {
  std::vector<std::string> found;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    const ServoLine line = this->line(i);
    const auto range = range_deg(i);
    const double first_deg = line.angle_deg(joint.pulse_range_us[0]);
    const double last_deg = line.angle_deg(joint.pulse_range_us[1]);
    for (const bool upper : {false, true}) {
      const double pulse_us = line.pulse_us(range[upper ? 1 : 0]);
      if (pulse_us >= joint.pulse_range_us[0] - kPulseTolerance_us &&
          pulse_us <= joint.pulse_range_us[1] + kPulseTolerance_us)
        continue;
      found.push_back(
          fmt::format("{}: its {} end, {:g} degrees, needs {:.0f} us; the servo goes from {:g} to {:g} us, "
                      "which is {:.1f} to {:.1f} degrees: set it with 'limit {}', or turn the horn",
                      joint.name, upper ? "high" : "low", range[upper ? 1 : 0], pulse_us,
                      joint.pulse_range_us[0], joint.pulse_range_us[1], std::min(first_deg, last_deg),
                      std::max(first_deg, last_deg), upper ? "high" : "low"));
    }
  }
  if (std::abs(closed_us_ - open_us_) < kLeastPulse_us)
    found.push_back(fmt::format("gripper: open and closed are less than {:g} us apart", kLeastPulse_us));
  return found;
}

std::vector<NumberEdit> Calibration::edits() const {
  std::vector<NumberEdit> edits;
  const auto add = [&](const std::string& path, double from, double to) {
    if (from != to) edits.push_back({path, to});
  };
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    const ServoLine line = this->line(i);
    const std::string servo = fmt::format("joint[{}].servo.", i);
    add(servo + "zero_us", joint.line.zero_us, line.zero_us);
    add(servo + "us_per_degree", joint.line.us_per_degree, line.us_per_degree);
    add(servo + "direction", joint.line.direction, line.direction);
    for (std::size_t end = 0; end < 2; ++end)
      add(fmt::format("joint[{}].range_deg[{}]", i, end), joint.range_deg[end], range_deg(i)[end]);
  }
  add("gripper.closed_us", profile_gripper_us_[0], closed_us_);
  add("gripper.open_us", profile_gripper_us_[1], open_us_);
  return edits;
}

std::string Calibration::text(std::size_t joint) const {
  const Joint& it = joints_[joint];
  const ServoLine line = this->line(joint);
  const auto range = range_deg(joint);
  std::string marks;
  for (const Mark& mark : it.marks)
    marks += fmt::format(", {:g} degrees at {:g} us", mark.angle_deg, mark.pulse_us);
  return fmt::format("{:<9} zero_us {:g}, us_per_degree {:g}, direction {}, range_deg {:g} to {:g}{}{}",
                     it.name, line.zero_us, line.us_per_degree, line.direction, range[0], range[1],
                     marks.empty() ? "" : "; marked", marks.empty() ? "" : marks.substr(1));
}

}  // namespace corbot::cli
