// SPDX-License-Identifier: Apache-2.0
#include "config/can_schema.h"

#include "config/output_schema.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>

#include <fmt/format.h>

#include "corbot/units.h"

namespace corbot {
namespace {

constexpr std::size_t kLongestInterface = 15;
constexpr std::size_t kLongestSocket = 107;
constexpr std::string_view kUnix = "unix:";
/// Half a turn at the finest scale, from the farthest zero, is still within 32 bits.
constexpr Bounds kCount{-1e9, 1e9, false, "counts"};
constexpr Bounds kScale{0, 5e6, true, "counts"};

constexpr int kShortestWatch_ms = 20;
/// corbot's own, as a producer of heartbeats.
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

CanHoming read_homing(Section& section) {
  constexpr Bounds kSpeed{0, 90, true, "degrees a second"};
  constexpr double kUsualSpeed_deg_s = 5.0;
  constexpr double kUsualCreep_deg_s = 1.0;
  CanHoming homing;
  if (!section.has("homing_method")) {
    for (const std::string_view key :
         {"homing_speed_deg_s", "homing_creep_deg_s", "homing_acceleration_deg_s2", "homing_offset"}) {
      if (!section.has(key)) continue;
      (void)section.number(key, {-1e9, 1e9, false, ""});
      section.refuse(key, "needs homing_method");
    }
    return homing;
  }
  const auto method = section.integer("homing_method", {-128, 127, false, "(6098h)"});
  if (method && *method == 0)
    section.refuse("homing_method", "must not be 0: leave it out for a drive that keeps its count");
  homing.method = static_cast<int>(method.value_or(0));
  homing.speed_q_s =
      kRadiansPerDegree * section.number_or("homing_speed_deg_s", kUsualSpeed_deg_s, kSpeed).value_or(0);
  homing.creep_q_s =
      kRadiansPerDegree * section.number_or("homing_creep_deg_s", kUsualCreep_deg_s, kSpeed).value_or(0);
  homing.acceleration_q_s2 =
      kRadiansPerDegree *
      section.number_or("homing_acceleration_deg_s2", 0, {0, 1e4, false, "(0: as the drive has it)"})
          .value_or(0);
  homing.offset = section.number_or("homing_offset", 0, kCount).value_or(0);
  return homing;
}

CanDrive read_drive(Section& section, NodeUse& in_use) {
  CanDrive drive;
  drive.node = read_node(section, in_use);
  drive.counts_per_q = section.number("counts_per_degree", kScale).value_or(0) / kRadiansPerDegree;
  drive.zero_count = section.number_or("zero_count", 0, kCount).value_or(0);
  const auto direction = section.integer_or("direction", 1, {-1, 1, false, "(1 or -1)"});
  if (direction && *direction == 0) section.refuse("direction", "must be 1 or -1");
  drive.direction = static_cast<double>(direction.value_or(1));
  drive.identity = read_identity(section);
  drive.reports_following = section.flag_or("reports_following", true).value_or(true);
  drive.homing = read_homing(section);
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

void read_socketcan(Section section, std::size_t joints, SocketCanOptions& options,
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
  for (Section& drive : drives) options.drives.push_back(read_drive(drive, in_use));
  if (joints > 0 && !drives.empty() && drives.size() != joints) {
    section.refuse("drive", fmt::format("are {} drives; the arm has {} joints, and each needs one",
                                        drives.size(), joints));
  }
  if (section.has("gripper")) {
    read_gripper(section.table("gripper"), in_use, options);
  } else {
    (void)section.table_or_empty("gripper");
  }
  if (const auto master = in_use.find(kMasterNode); options.watch_ms > 0 && master != in_use.end()) {
    section.refuse("watch_ms", fmt::format("needs node {} for corbot itself, but it is that of {}",
                                           kMasterNode, master->second));
  }
  section.finish();
}

}  // namespace corbot
