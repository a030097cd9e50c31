// SPDX-License-Identifier: Apache-2.0
#include "config/can_schema.h"

#include "config/output_schema.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include <fmt/format.h>

#include "corbot/units.h"

namespace corbot {
namespace {

constexpr std::size_t kLongestInterface = 15;
constexpr std::string_view kUnix = "unix:";
constexpr Bounds kCount{-1e9, 1e9, false, "counts"};
/// Farthest position in a drive, 607Ah.
constexpr double kFarthestCount = 2147483647.0;

/// The keys of a drive whose names contain a unit, and their bounds.
struct DriveKeys {
  std::string_view scale, homing_speed, homing_creep, homing_acceleration;
  Bounds scale_bounds, speed_bounds;
  double usual_speed, usual_creep;
  double si_per_unit;
};
constexpr DriveKeys kTurningDrive{"counts_per_degree",
                                  "homing_speed_deg_s",
                                  "homing_creep_deg_s",
                                  "homing_acceleration_deg_s2",
                                  {0, 5e6, true, "counts"},
                                  {0, 90, true, "degrees a second"},
                                  5.0,
                                  1.0,
                                  kRadiansPerDegree};
constexpr DriveKeys kSlidingDrive{"counts_per_m",
                                  "homing_speed_m_s",
                                  "homing_creep_m_s",
                                  "homing_acceleration_m_s2",
                                  {0, 1e9, true, "counts"},
                                  {0, 0.5, true, "m a second"},
                                  0.02,
                                  0.002,
                                  1.0};

constexpr int kShortestWatch_ms = 20;
/// Node number of corbot as a producer of heartbeats.
constexpr int kMasterNode = 127;

using NodeUse = std::map<std::int64_t, std::string>;

bool is_interface(const std::string& text) {
  if (text.starts_with(kUnix)) {
    const std::size_t length = text.size() - kUnix.size();
    return text.find('/') == kUnix.size() && length > 1 && length <= kLongestSocket;
  }
  return !text.empty() && text.size() <= kLongestInterface &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                  c == '-' || c == '.';
         });
}

int read_node(Section& section, NodeUse& in_use) {
  const auto node = section.integer("node", {1, 127, false, ""});
  if (!node) return 0;
  const auto [user, is_new] = in_use.emplace(*node, section.full_key("node"));
  if (!is_new) {
    section.refuse("node", fmt::format("is used by {}; every drive needs a node of its own", user->second));
  }
  return static_cast<int>(*node);
}

CanIdentity read_identity(Section& section) {
  constexpr Bounds kNumber{0, 4294967295.0, false, ""};
  constexpr std::array<std::string_view, 4> kKeys{"vendor", "product", "revision", "serial"};
  CanIdentity identity;
  for (std::size_t i = 0; i < kKeys.size(); ++i) {
    if (!section.has(kKeys[i])) continue;
    const auto number = section.integer(kKeys[i], kNumber);
    if (number) identity[i] = static_cast<std::uint32_t>(*number);
  }
  return identity;
}

CanHoming read_homing(Section& section, const DriveKeys& keys) {
  CanHoming homing;
  if (!section.has("homing_method")) {
    for (const std::string_view key : {keys.homing_speed, keys.homing_creep, keys.homing_acceleration,
                                       std::string_view{"homing_offset"}}) {
      if (!section.has(key)) continue;
      (void)section.number(key, {-1e9, 1e9, false, ""});
      section.refuse(key, "needs homing_method");
    }
    return homing;
  }
  const auto method = section.integer("homing_method", {-128, 127, false, "(6098h)"});
  if (method && *method == 0)
    section.refuse("homing_method", "must not be 0: leave the key out for a drive that keeps its count");
  const auto read = [&](std::string_view key, double usual, const Bounds& bounds) {
    return keys.si_per_unit * section.number_or(key, usual, bounds).value_or(0);
  };
  homing.method = static_cast<int>(method.value_or(0));
  homing.speed_q_s = read(keys.homing_speed, keys.usual_speed, keys.speed_bounds);
  homing.creep_q_s = read(keys.homing_creep, keys.usual_creep, keys.speed_bounds);
  homing.acceleration_q_s2 = read(keys.homing_acceleration, 0, {0, 1e4, false, "(0: as the drive has it)"});
  homing.offset = section.number_or("homing_offset", 0, kCount).value_or(0);
  return homing;
}

void refuse_others(Section& section, const DriveKeys& keys) {
  const bool turns = &keys == &kTurningDrive;
  const DriveKeys& others = turns ? kSlidingDrive : kTurningDrive;
  for (const auto key : {&DriveKeys::scale, &DriveKeys::homing_speed, &DriveKeys::homing_creep,
                         &DriveKeys::homing_acceleration}) {
    if (section.has(others.*key) && !section.has(keys.*key))
      section.refuse_for(others.*key, keys.*key, turns ? "the joint turns" : "the joint slides");
  }
}

CanDrive read_drive(Section& section, const DrivenJoint& joint, NodeUse& in_use) {
  const DriveKeys& keys = joint.kind == JointKind::kRotary ? kTurningDrive : kSlidingDrive;
  refuse_others(section, keys);
  CanDrive drive;
  drive.node = read_node(section, in_use);
  drive.counts_per_q = section.number(keys.scale, keys.scale_bounds).value_or(0) / keys.si_per_unit;
  drive.zero_count = section.number_or("zero_count", 0, kCount).value_or(0);
  const double farthest = std::abs(drive.zero_count) + drive.counts_per_q * joint.farthest_q;
  if (farthest > kFarthestCount) {
    section.refuse(keys.scale, fmt::format("gives {:.0f} counts at the end of the joint's range, but a drive "
                                           "counts up to {:.0f}: correct it, or the range",
                                           farthest, kFarthestCount));
  }
  const auto direction = section.integer_or("direction", 1, {-1, 1, false, "(1 or -1)"});
  if (direction && *direction == 0) section.refuse("direction", "must be 1 or -1");
  drive.direction = static_cast<double>(direction.value_or(1));
  drive.identity = read_identity(section);
  drive.reports_following = section.flag_or("reports_following", true).value_or(true);
  drive.homing = read_homing(section, keys);
  section.finish();
  return drive;
}

void read_gripper(Section section, NodeUse& in_use, SocketCanOptions& options) {
  options.gripper_node = read_node(section, in_use);
  const auto closed = section.number("closed_count", kCount);
  const auto open = section.number("open_count", kCount);
  if (closed && open && *closed == *open) section.refuse("open_count", "must differ from closed_count");
  options.gripper_closed_count = closed.value_or(0);
  options.gripper_open_count = open.value_or(0);
  options.gripper_identity = read_identity(section);
  options.gripper_reports_following = section.flag_or("reports_following", true).value_or(true);
  section.finish();
}

}  // namespace

void read_socketcan(Section section, std::span<const DrivenJoint> joints, SocketCanOptions& options,
                    CommonBackendOptions& common) {
  options.interface = section.text("interface").value_or("");
  if (section.has("interface") && !is_interface(options.interface)) {
    section.refuse("interface",
                   "must be a CAN interface such as \"can0\", or \"unix:/path\" for a virtual bus");
  }
  options.bit_rate = static_cast<int>(
      section.integer_or("bit_rate", 0, {0, 1e6, false, "bit/s (0: as the interface is set)"}).value_or(0));
  options.heartbeat_ms =
      static_cast<int>(section.integer_or("heartbeat_ms", 200, {10, 5000, false, "ms"}).value_or(200));
  const auto watch_ms = section.integer_or("watch_ms", 0, {0, 5000, false, "ms (0: off)"});
  if (watch_ms && *watch_ms > 0 && *watch_ms < kShortestWatch_ms) {
    section.refuse("watch_ms", fmt::format("must be 0 (off), or {} to 5000 ms", kShortestWatch_ms));
  }
  options.watch_ms = static_cast<int>(watch_ms.value_or(0));
  common = read_common(section, true);
  NodeUse in_use;
  options.drives.clear();
  auto drives = section.tables("drive");
  for (std::size_t i = 0; i < drives.size(); ++i) {
    options.drives.push_back(read_drive(drives[i], i < joints.size() ? joints[i] : DrivenJoint{}, in_use));
  }
  if (!joints.empty() && !drives.empty() && drives.size() != joints.size()) {
    section.refuse(
        "drive",
        fmt::format(
            "are {} drives, but the arm has {} joints: write one [[backend.socketcan.drive]] for each joint",
            drives.size(), joints.size()));
  }
  if (section.has("gripper")) {
    read_gripper(section.table("gripper"), in_use, options);
  } else {
    (void)section.table_or_empty("gripper");
  }
  if (const auto master = in_use.find(kMasterNode); options.watch_ms > 0 && master != in_use.end()) {
    section.refuse("watch_ms", fmt::format("needs node {} for corbot itself, but {} has that node: give the "
                                           "drive another one, or set watch_ms = 0",
                                           kMasterNode, master->second));
  }
  section.finish();
}

}  // namespace corbot
