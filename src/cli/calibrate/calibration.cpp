// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "corbot/units.h"

namespace corbot::cli {

namespace {

constexpr double kLeastPulse_us = 50.0;
constexpr double kRounding_us = 1e-6;
constexpr double kRounding = 1e-6;  // of a value that was computed from a pulse
/// Hobby servos have about 10 us per degree; gears and linkages change that within these bounds.
constexpr MarkUnit kDegrees{
    "degrees", "degree", "us_per_degree", "range_deg", 1.0, kRadiansPerDegree, 10.0, 90.0, 2.0, 60.0, 180.0};
/// Sliding joints use a rack, a screw or a crank: the 2000 us of a servo are 10 mm to 4 m.
constexpr MarkUnit kMillimetres{"mm", "mm", "us_per_mm", "range_m", 1000.0,  1e-3,
                                5.0,  50.0, 0.5,         200.0,     10'000.0};

double in_steps(double value, double steps) { return std::round(value * steps) / steps; }

/// Rounds inwards, so that the joint can reach the end.
double rounded_end(double value, bool upper) {
  constexpr double kSteps = 10.0;
  return (upper ? std::floor(value * kSteps + kRounding) : std::ceil(value * kSteps - kRounding)) / kSteps +
         0.0;
}

/// Converts to the unit of the profile.
double in_profile(const MarkUnit& unit, double value) { return in_steps(value / unit.range_key_units, 1e9); }

}  // namespace

const MarkUnit& unit_of(JointKind kind) noexcept {
  return kind == JointKind::kRotary ? kDegrees : kMillimetres;
}

LineResult line_through(const Mark& a, const Mark& b, const MarkUnit& unit) {
  const double way = b.value - a.value;
  const double pulse_us = b.pulse_us - a.pulse_us;
  if (std::abs(way) < unit.least || std::abs(pulse_us) < kLeastPulse_us) {
    return {std::nullopt, fmt::format("the two marks are only {:.4g} {} and {:.4g} us apart: mark places at "
                                      "least {:g} {} and {:g} us apart, better {:g} {}",
                                      std::abs(way), unit.name, std::abs(pulse_us), unit.least, unit.name,
                                      kLeastPulse_us, unit.better, unit.name)};
  }
  const double slope = pulse_us / way;
  ServoLine line;
  line.direction = slope > 0.0 ? 1 : -1;
  line.us_per_unit = in_steps(std::abs(slope), 1e3);
  // The line goes through the middle of both marks, so that the rounding error of the scale is equal at
  // either.
  const double middle = 0.5 * (a.value + b.value);
  line.zero_us = in_steps(0.5 * (a.pulse_us + b.pulse_us) - line.direction * line.us_per_unit * middle, 1e2);
  if (line.us_per_unit < unit.scale_min || line.us_per_unit > unit.scale_max) {
    return {std::nullopt,
            fmt::format(
                "the marks give {:.4g} us a {}, plausible are {:g} to {:g}: check the values of both marks",
                line.us_per_unit, unit.one, unit.scale_min, unit.scale_max)};
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
    const MarkUnit& unit = unit_of(profile.arm.kinematics.joint_kind(i));
    joint.unit = &unit;
    joint.line = {map.zero_us, in_steps(map.us_per_q * unit.q_per_unit, 1e9), map.direction > 0.0 ? 1 : -1};
    joint.range = {in_steps(limits.lower_q / unit.q_per_unit, 1e9),
                   in_steps(limits.upper_q / unit.q_per_unit, 1e9)};
    joint.pulse_range_us = {map.pulse_min_us, map.pulse_max_us};
    joints_.push_back(std::move(joint));
  }
}

ServoLine Calibration::line(std::size_t joint) const {
  const Joint& it = joints_[joint];
  if (it.marks.size() == 2) {
    if (const auto result = line_through(it.marks[0], it.marks[1], *it.unit); result.line)
      return *result.line;
  }
  ServoLine line = it.line;
  if (it.marks.empty()) return line;
  const Mark& mark = it.marks.back();
  line.zero_us = in_steps(mark.pulse_us - line.direction * line.us_per_unit * mark.value, 1e2);
  return line;
}

std::array<double, 2> Calibration::range(std::size_t joint) const {
  const Joint& it = joints_[joint];
  std::array<double, 2> range = it.range;
  for (const bool upper : {false, true}) {
    if (const auto pulse_us = it.limit_us[upper ? 1 : 0])
      range[upper ? 1 : 0] = rounded_end(line(joint).value(*pulse_us), upper);
  }
  return range;
}

void Calibration::remember() { before_.push_back({joints_, closed_us_, open_us_}); }

std::string Calibration::mark(std::size_t joint, const Mark& mark) {
  const MarkUnit& unit = *joints_[joint].unit;
  if (!(std::abs(mark.value) <= unit.widest))
    return fmt::format("from {:g} to {:g} {}", -unit.widest, unit.widest, unit.name);
  std::vector<Mark> marks = joints_[joint].marks;
  const auto same =
      std::find_if(marks.begin(), marks.end(), [&](const Mark& other) { return other.value == mark.value; });
  if (same != marks.end()) marks.erase(same);  // the newer measurement counts
  if (marks.size() == 2) marks.erase(marks.begin());
  marks.push_back(mark);
  if (marks.size() == 2) {
    if (const auto result = line_through(marks[0], marks[1], unit); !result.line) return result.fault;
  }
  remember();
  joints_[joint].marks = std::move(marks);
  return "";
}

std::string Calibration::limit(std::size_t joint, bool upper, double pulse_us) {
  const MarkUnit& unit = *joints_[joint].unit;
  const double value = line(joint).value(pulse_us);
  const char* const name = upper ? "high" : "low";
  if (std::abs(value) > unit.widest)
    return fmt::format("this place is at {:.1f} {}, the widest range ends at {:g}: check the marks", value,
                       unit.name, unit.widest);
  if (upper ? value < -kRounding : value > kRounding) {
    return fmt::format(
        "the {} end would be at {:.1f} {}, but the range must contain 0, where 'ready' goes: choose another "
        "end",
        name, value, unit.name);
  }
  remember();
  joints_[joint].limit_us[upper ? 1 : 0] = pulse_us;
  return "";
}

void Calibration::mark_gripper(bool open, double pulse_us) {
  remember();
  (open ? open_us_ : closed_us_) = in_steps(pulse_us, 1e2);
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
    const auto range = this->range(i);
    const double first = line.value(joint.pulse_range_us[0]);
    const double last = line.value(joint.pulse_range_us[1]);
    for (const bool upper : {false, true}) {
      const double pulse_us = line.pulse_us(range[upper ? 1 : 0]);
      if (pulse_us >= joint.pulse_range_us[0] - kRounding_us &&
          pulse_us <= joint.pulse_range_us[1] + kRounding_us)
        continue;
      found.push_back(
          fmt::format("{}: its {} end, {:g} {}, needs {:.0f} us. The servo goes from {:g} to {:g} us, "
                      "which is {:.1f} to {:.1f} {}. Set the end with 'limit {}', or turn the horn",
                      joint.name, upper ? "high" : "low", range[upper ? 1 : 0], joint.unit->name, pulse_us,
                      joint.pulse_range_us[0], joint.pulse_range_us[1], std::min(first, last),
                      std::max(first, last), joint.unit->name, upper ? "high" : "low"));
    }
  }
  if (std::abs(closed_us_ - open_us_) < kLeastPulse_us)
    found.push_back(
        fmt::format("gripper: the marks 'open' and 'closed' are less than {:g} us apart: mark both again",
                    kLeastPulse_us));
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
    add(servo + joint.unit->scale_key, joint.line.us_per_unit, line.us_per_unit);
    add(servo + "direction", joint.line.direction, line.direction);
    for (std::size_t end = 0; end < 2; ++end)
      add(fmt::format("joint[{}].{}[{}]", i, joint.unit->range_key, end),
          in_profile(*joint.unit, joint.range[end]), in_profile(*joint.unit, range(i)[end]));
  }
  add("gripper.closed_us", profile_gripper_us_[0], closed_us_);
  add("gripper.open_us", profile_gripper_us_[1], open_us_);
  return edits;
}

std::string Calibration::text(std::size_t joint) const {
  const Joint& it = joints_[joint];
  const ServoLine line = this->line(joint);
  const auto range = this->range(joint);
  std::string marks;
  for (const Mark& mark : it.marks)
    marks += fmt::format(", {:g} {} at {:g} us", mark.value, it.unit->name, mark.pulse_us);
  return fmt::format("{:<9} zero_us {:g}, {} {:g}, direction {}, {} {:g} to {:g}{}{}", it.name, line.zero_us,
                     it.unit->scale_key, line.us_per_unit, line.direction, it.unit->range_key,
                     in_profile(*it.unit, range[0]), in_profile(*it.unit, range[1]),
                     marks.empty() ? "" : "; marked", marks.empty() ? "" : marks.substr(1));
}

}  // namespace corbot::cli
