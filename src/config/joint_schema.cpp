// SPDX-License-Identifier: Apache-2.0
#include "config/joint_schema.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "config/joint_keys.h"
#include "corbot/units.h"

namespace corbot {
namespace {

constexpr double kPulseMinUs = 500.0;
constexpr double kPulseMaxUs = 2500.0;
/// Tolerance of a pulse computed at the end of a range: far below a servo's resolution, far above rounding.
constexpr double kPulseToleranceUs = 1e-6;
/// Largest speed of a joint as a share of the simulated servo's.
constexpr double kShareOfRate = 0.8;
/// Tolerance of a URDF's limits, which often have four digits.
constexpr double kLimitTolerance_q = 1e-3;

constexpr Bounds kPulse{kPulseMinUs, kPulseMaxUs, false, "us"};

constexpr JointKeys kTurning{"range_deg",
                             "speed_deg_s",
                             "acceleration_deg_s2",
                             "jerk_deg_s3",
                             "following_error_deg",
                             "goal_tolerance_deg",
                             "home_deg",
                             "us_per_degree",
                             "degrees/s",
                             "degrees/s^2",
                             "degrees/s^3",
                             {-3600, 3600, false, "degrees"},
                             {0, 180, true, "degrees"},
                             {0, 90, true, "degrees"},
                             15,
                             1,
                             kRadiansPerDegree,
                             1.0};
constexpr JointKeys kSliding{"range_m",
                             "speed_m_s",
                             "acceleration_m_s2",
                             "jerk_m_s3",
                             "following_error_m",
                             "goal_tolerance_m",
                             "home_m",
                             "us_per_mm",
                             "m/s",
                             "m/s^2",
                             "m/s^3",
                             {-10, 10, false, "m"},
                             {0, 1, true, "m"},
                             {0, 0.5, true, "m"},
                             0.02,
                             0.001,
                             1.0,
                             1000.0};

std::uint32_t read_channel(Section& section, ChannelUse& in_use) {
  const auto read = section.integer("channel", {0, 31, false, ""});
  if (!read) return 0;
  const auto channel = static_cast<std::uint32_t>(*read);
  const auto [user, is_new] = in_use.emplace(channel, section.full_key("channel"));
  if (!is_new)
    section.refuse("channel",
                   fmt::format("is used by {}; every servo needs a channel of its own", user->second));
  return channel;
}

/// Checks that the servo accepts the pulses at both ends of the joint's range. `scale`: us per degree, or per
/// metre.
void check_pulses(Section& joint, const JointKeys& keys, const std::array<double, 2>& range, double zero_us,
                  double scale, double direction, const std::array<double, 2>& pulse_us) {
  for (const double end : range) {
    const double pulse = zero_us + direction * scale * end;
    if (pulse >= pulse_us[0] - kPulseToleranceUs && pulse <= pulse_us[1] + kPulseToleranceUs) continue;
    joint.refuse(keys.range, fmt::format("needs a pulse of {:.6g} us at {} {}, but pulse_range_us allows {} "
                                         "to {} us: narrow the range, or correct zero_us",
                                         pulse, end, keys.value.unit, pulse_us[0], pulse_us[1]));
  }
}

ServoMap read_servo(Section& joint, const JointKeys& keys, const std::optional<std::array<double, 2>>& range,
                    ChannelUse& in_use) {
  Section section = joint.table("servo");
  ServoMap map;
  map.channel = read_channel(section, in_use);
  const bool turns = &keys == &kTurning;
  const std::string_view other_scale = (turns ? kSliding : kTurning).servo_scale;
  if (section.has(other_scale) && !section.has(keys.servo_scale))
    section.refuse_for(other_scale, keys.servo_scale, turns ? "the joint turns" : "the joint slides");
  const auto zero = section.number("zero_us", {-10000, 10000, false, "us"});
  const auto scale = section.number(keys.servo_scale, {0, 1000, true, "us"});
  const auto direction = section.integer("direction", {-1, 1, false, "(1 or -1)"});
  if (direction && *direction == 0) section.refuse("direction", "must be 1 or -1");
  const auto pulses = section.range("pulse_range_us", kPulse);
  section.finish();
  if (!zero || !scale || !direction || *direction == 0 || !pulses) return map;
  const double us_per_unit = *scale * keys.servo_units_per_unit;
  map.zero_us = *zero;
  map.us_per_q = us_per_unit / keys.si_per_unit;
  map.direction = static_cast<double>(*direction);
  map.pulse_min_us = (*pulses)[0];
  map.pulse_max_us = (*pulses)[1];
  if (range) check_pulses(joint, keys, *range, *zero, us_per_unit, map.direction, *pulses);
  return map;
}

void check_range(Section& joint, const JointKeys& keys, const std::array<double, 2>& range, std::size_t index,
                 const GeometryInput& geometry) {
  if (range[0] > 0 || range[1] < 0)
    joint.refuse(keys.range, "must contain 0, to which 'corbot ready' moves every joint");
  const config::UrdfJoint& urdf = geometry.urdf.joints[index];
  if (!urdf.is_bounded) return;
  const double lower = urdf.lower_q - geometry.home_q[index], upper = urdf.upper_q - geometry.home_q[index];
  if (range[0] * keys.si_per_unit >= lower - kLimitTolerance_q &&
      range[1] * keys.si_per_unit <= upper + kLimitTolerance_q)
    return;
  joint.refuse(keys.range,
               fmt::format("is beyond the limits of \"{}\" in the URDF, {:.6g} to {:.6g} {}", urdf.name,
                           lower / keys.si_per_unit, upper / keys.si_per_unit, keys.value.unit));
}

/// Refuses a joint with the name of another joint of the URDF: its place is wrong, so it would get the wrong
/// ranges.
void check_place(Section& joint, const std::string& name, std::size_t index, const GeometryInput& geometry) {
  const auto& joints = geometry.urdf.joints;
  const std::size_t count = geometry.urdf.chain.count;
  if (index >= count || joints[index].name == name) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (joints[i].name != name) continue;
    joint.refuse(
        "name",
        fmt::format(
            "is joint {} of the URDF, whose joint {} is \"{}\": write the joints in the order of the URDF", i,
            index, joints[index].name));
  }
}

void read_joint(Section& section, std::size_t index, Profile& profile, GeometryInput& geometry,
                bool needs_servos, ChannelUse& in_use) {
  JointLimits& limits = profile.arm.joints[index];
  const std::string name = read_name(section, "name");
  if (!name.empty() && std::count(profile.joint_names.begin(), profile.joint_names.end(), name) > 0) {
    section.refuse("name", "is the name of an earlier joint: give each joint its own name");
  }
  check_place(section, name, index, geometry);
  profile.joint_names.push_back(name);
  const JointKind kind = read_joint_geometry(section, index, geometry);
  const JointKeys& keys = keys_of(kind);
  const double si = keys.si_per_unit;
  const bool is_paper_arm = geometry.form == config::GeometryForm::kLengths;
  const auto range = section.range(keys.range, is_paper_arm ? kHalfTurn_deg : keys.value);
  if (range) {
    limits.lower_q = (*range)[0] * si;
    limits.upper_q = (*range)[1] * si;
    check_range(section, keys, *range, index, geometry);
  }
  geometry.joints.push_back({kind, std::max(std::abs(limits.lower_q), std::abs(limits.upper_q))});
  limits.speed_q_s = section.number(keys.speed, limit(keys.speed_unit)).value_or(0) * si;
  limits.acceleration_q_s2 =
      section.number(keys.acceleration, limit(keys.acceleration_unit)).value_or(0) * si;
  limits.jerk_q_s3 = section.number(keys.jerk, limit(keys.jerk_unit)).value_or(0) * si;
  const bool has_servo = needs_servos || section.has("servo");
  if (has_servo) profile.arm.servos[index] = read_servo(section, keys, range, in_use);
  section.skip("servo");
  profile.has_servo.push_back(has_servo);
  FollowingLimits& following = profile.following.emplace_back();
  following.error_q =
      section.number_or(keys.following_error, keys.usual_following, keys.following).value_or(0) * si;
  following.time_s = section.number_or("following_error_s", 0.25, {0.001, 10, false, "s"}).value_or(0);
  following.goal_q = section.number_or(keys.goal_tolerance, keys.usual_goal, keys.goal).value_or(0) * si;
  section.finish();
}

std::uint32_t free_channel(ChannelUse& in_use, const std::string& key) {
  std::uint32_t channel = 0;
  while (!in_use.emplace(channel, key).second) ++channel;
  return channel;
}

}  // namespace

const JointKeys& keys_of(JointKind kind) noexcept {
  return kind == JointKind::kPrismatic ? kSliding : kTurning;
}

void JointKeys::refuse_others(Section& joint, const std::string& why) const {
  const JointKeys& others = this == &kTurning ? kSliding : kTurning;
  constexpr std::array kKeys{&JointKeys::range, &JointKeys::speed,           &JointKeys::acceleration,
                             &JointKeys::jerk,  &JointKeys::following_error, &JointKeys::goal_tolerance,
                             &JointKeys::home};
  for (const auto key : kKeys) {
    if (joint.has(others.*key) && !joint.has(this->*key)) joint.refuse_for(others.*key, this->*key, why);
  }
}

std::string read_name(Section& section, std::string_view key) {
  auto name = section.text(key);
  if (!name || is_name(*name)) return name.value_or("");
  section.refuse(key, "must be " + name_rule());
  return "";
}

void read_joints(Section& root, Profile& profile, GeometryInput& geometry, bool needs_servos,
                 ChannelUse& in_use) {
  auto joints = root.tables("joint");
  if (joints.empty()) return;
  const std::size_t wanted = joints_of(geometry);
  if (geometry.form == config::GeometryForm::kLengths && joints.size() != wanted) {
    root.refuse(
        "joint",
        fmt::format(
            "are {} joints, but an anthropomorphic arm of this family has {}: base, shoulder, elbow, wrist",
            joints.size(), wanted));
  } else if (wanted > 0 && joints.size() != wanted) {
    std::vector<std::string_view> names;
    for (std::size_t i = 0; i < wanted; ++i) names.push_back(geometry.urdf.joints[i].name);
    root.refuse("joint",
                fmt::format("are {} joints, but the URDF has {} between the links base_link and tip_link: {}",
                            joints.size(), wanted, fmt::join(names, ", ")));
  } else if (joints.size() > kMaxJoints) {
    root.refuse("joint", fmt::format("are {} joints, but an arm has 1 to {}", joints.size(), kMaxJoints));
  }
  const bool is_right = joints.size() <= kMaxJoints && (wanted == 0 || joints.size() == wanted);
  geometry.is_complete = geometry.is_complete && is_right;
  profile.arm.dof = static_cast<std::uint32_t>(wanted > 0 ? wanted : std::min(joints.size(), kMaxJoints));
  for (std::size_t i = 0; i < std::min(joints.size(), kMaxJoints); ++i)
    read_joint(joints[i], i, profile, geometry, needs_servos, in_use);
  if (!is_right) geometry.joints.clear();
}

void read_gripper(Section section, Profile& profile, bool needs_servos, ChannelUse& in_use) {
  GripperModel& gripper = profile.arm.gripper;
  const bool has_pulses =
      needs_servos || section.has("channel") || section.has("closed_us") || section.has("open_us");
  if (has_pulses && section.present()) {
    gripper.channel = read_channel(section, in_use);
    const auto closed = section.number("closed_us", kPulse);
    const auto open = section.number("open_us", kPulse);
    if (closed && open && *closed == *open) section.refuse("open_us", "must differ from closed_us");
    gripper.closed_us = closed.value_or(0);
    gripper.open_us = open.value_or(0);
  } else {
    for (const std::string_view key : {"channel", "closed_us", "open_us"}) section.skip(key);
  }
  profile.gripper_has_servo = has_pulses;
  gripper.travel_s = section.number("travel_s", {0.01, 60, false, "s"}).value_or(0);
  section.finish();
}

void fit_servos(Profile& profile, ChannelUse& in_use) {
  const double rate_us_s = kShareOfRate * profile.backend.loopback.rate_us_per_s;
  for (std::size_t i = 0; i < profile.has_servo.size(); ++i) {
    const JointLimits& limits = profile.arm.joints[i];
    const double range_q = limits.upper_q - limits.lower_q;
    if (profile.has_servo[i] || !(range_q > 0) || !(limits.speed_q_s > 0)) continue;
    ServoMap& map = profile.arm.servos[i];
    map.channel = free_channel(in_use, fmt::format("joint[{}]", i));
    map.us_per_q = std::min((kPulseMaxUs - kPulseMinUs) / range_q, rate_us_s / limits.speed_q_s);
    map.zero_us = 0.5 * (kPulseMinUs + kPulseMaxUs) - map.us_per_q * 0.5 * (limits.lower_q + limits.upper_q);
    map.direction = 1.0;
    map.pulse_min_us = kPulseMinUs;
    map.pulse_max_us = kPulseMaxUs;
  }
  if (profile.gripper_has_servo) return;
  GripperModel& gripper = profile.arm.gripper;
  const double travel_us = std::min(1000.0, rate_us_s * gripper.travel_s);
  gripper.channel = free_channel(in_use, "gripper");
  gripper.closed_us = 1500.0 - 0.5 * travel_us;
  gripper.open_us = 1500.0 + 0.5 * travel_us;
}

}  // namespace corbot
