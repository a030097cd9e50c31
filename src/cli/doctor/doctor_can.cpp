// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string_view>

#include "cli/doctor/device_findings.h"
#include "rt/backends/can/can_link.h"
#include "rt/backends/can/can_load.h"
#include "rt/backends/can/drive_bus.h"
#include "rt/backends/can/sdo_client.h"

namespace corbot::cli {

namespace {

constexpr std::string_view kUnix = "unix:";
constexpr std::uint32_t kProfile402 = 402;

struct Node {
  std::uint8_t number;
  CanIdentity identity;
};

std::vector<Node> nodes_of(const SocketCanOptions& options) {
  std::vector<Node> nodes;
  for (const CanDrive& drive : options.drives) {
    nodes.push_back({static_cast<std::uint8_t>(drive.node), drive.identity});
  }
  if (options.gripper_node > 0) {
    nodes.push_back({static_cast<std::uint8_t>(options.gripper_node), options.gripper_identity});
  }
  return nodes;
}

std::vector<std::uint8_t> numbers_of(const std::vector<Node>& nodes) {
  std::vector<std::uint8_t> numbers;
  for (const Node& node : nodes) numbers.push_back(node.number);
  return numbers;
}

/// Examines the socket of a virtual bus; returns nothing if it is usable.
std::optional<Finding> socket_fault(const std::string& what, const std::string& path,
                                    const std::string& fix) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    return device_failure(fmt::format("{}: {}", what, std::strerror(errno)), fix);
  }
  if (S_ISSOCK(status.st_mode)) return std::nullopt;
  const char* kind = S_ISDIR(status.st_mode)   ? "a directory"
                     : S_ISREG(status.st_mode) ? "a file"
                                               : "no socket";
  return device_failure(fmt::format("{}: is {}, and no CAN bus", what, kind), fix);
}

/// Examines the controller of the bus. Returns true if nodes can be queried.
bool examine_link(const std::string& what, const SocketCanOptions& options, const Profile& profile,
                  Findings& findings) {
  const std::string& name = options.interface;
  if (name.find('/') != std::string::npos) {
    findings.push_back(
        device_failure(what + ": a path is no interface",
                       "give the name of an interface (ip link shows them), or unix:PATH for a virtual bus"));
    return false;
  }
  const auto link = rt::read_can_link(name);
  if (!link) {
    findings.push_back(device_failure(
        what + ": no such interface",
        "plug the adapter in (ip link shows it), or correct backend.socketcan.interface in the profile"));
    return false;
  }
  if (!link->is_can) {
    findings.push_back(device_failure(what + " is not a CAN interface",
                                      "correct backend.socketcan.interface in the profile"));
    return false;
  }
  if (!link->is_up) {
    findings.push_back(
        device_failure(what + " is down",
                       fmt::format("sudo ip link set {} up type can bitrate 1000000 restart-ms 100", name)));
    return false;
  }
  for (Finding& finding : examine_can_link(*link, name)) findings.push_back(std::move(finding));
  if (link->bit_rate && options.bit_rate != 0 && *link->bit_rate != static_cast<unsigned>(options.bit_rate)) {
    findings.push_back(device_failure(
        fmt::format("{}: {} bit/s, the profile says {}", what, *link->bit_rate, options.bit_rate),
        "correct backend.socketcan.bit_rate, or set the interface to it"));
  }
  const std::size_t drives = nodes_of(options).size();
  if (link->bit_rate && !rt::sync_period_ns(drives, profile.arm.period_ns, *link->bit_rate)) {
    findings.push_back(
        device_failure(fmt::format("{}: {} bit/s cannot carry {} drives", what, *link->bit_rate, drives),
                       "use a faster bus: docs/wiring/socketcan.md"));
  }
  return link->state != rt::CanBusState::kBusOff;
}

std::string hex(std::uint32_t value) { return fmt::format("{:08X}h", value); }

constexpr std::array<const char*, 4> kIdentity{"vendor", "product", "revision", "serial"};  // 1018h:1 to 4

/// Returns the node's identity as far as it has one. Adds deviations from the profile to `differs`.
std::string identity(rt::SdoClient& node, const CanIdentity& expected, std::string& differs) {
  std::string text;
  for (std::size_t i = 0; i < kIdentity.size(); ++i) {
    const auto value = node.read_if_there({0x1018, static_cast<std::uint8_t>(i + 1)});
    if (value) text += fmt::format(", {} {}", kIdentity[i], hex(*value));
    if (!expected[i] || value == expected[i]) continue;
    differs += fmt::format("{}{} {}", differs.empty() ? "" : ", ", kIdentity[i], hex(*expected[i]));
  }
  return text;
}

void examine_node(const std::string& what, const Node& drive, rt::SdoClient node, Findings& findings) {
  const std::string name = fmt::format("{}: node {}", what, drive.number);
  const std::uint32_t type = node.read({0x1000, 0});
  std::string text = name;
  if (const std::string model = node.read_text({0x1008, 0}); !model.empty()) text += ": " + model;
  if (const std::string firmware = node.read_text({0x100A, 0}); !firmware.empty()) {
    text += ", firmware " + firmware;
  }
  std::string differs;
  text += identity(node, drive.identity, differs);
  if ((type & 0xFFFF) != kProfile402) {
    findings.push_back(
        device_failure(fmt::format("{}: device type {} is no drive after CiA 402", text, hex(type)),
                       "correct the node's number in the profile"));
    return;
  }
  if (!differs.empty()) {
    findings.push_back(
        device_failure(fmt::format("{}; the profile has {}", text, differs),
                       "another drive than the profile's: correct the node's number or identity"));
    return;
  }
  findings.push_back(device_ok(text));
  const auto word = static_cast<std::uint16_t>(node.read({0x6041, 0}));
  const rt::DriveState state = rt::state_of(word);
  text = fmt::format("{} is in '{}'", name, rt::to_string(state));
  if (const auto voltage = node.read_if_there({0x6079, 0})) {
    text += fmt::format(", DC link {:.1f} V", *voltage / 1000.0);
  }
  if (state == rt::DriveState::kFault || state == rt::DriveState::kFaultReactionActive) {
    const auto code = static_cast<std::uint16_t>(node.read_if_there({0x603F, 0}).value_or(0));
    findings.push_back(device_failure(
        text + (code != 0 ? ": " + rt::describe_emergency(code) : ""),
        "see the drive's manual for the code; corbot resets the fault when it enables the drive"));
  } else if ((word & rt::kStatusVoltage) == 0) {
    findings.push_back(device_warning(text + ", no voltage at its power stage",
                                      "release STO, switch the power supply on; a drive that switches it by "
                                      "itself shows this until it is enabled"));
  } else if (state == rt::DriveState::kOperationEnabled) {
    findings.push_back(device_warning(
        text + ": it holds the arm",
        "at_end = \"hold\" leaves it so; if the profile has another at_end, find out what enabled it"));
  } else {
    findings.push_back(device_ok(text));
  }
}

}  // namespace

Findings examine_can_link(const rt::CanLink& link, const std::string& name) {
  const std::string what = "backend socketcan: " + name;
  Findings findings;
  std::string text = what + " is up";
  if (link.bit_rate) text += fmt::format(", {} bit/s", *link.bit_rate);
  if (!link.state) {
    findings.push_back(device_ok(text + ", has no controller (vcan)"));
    return findings;
  }
  text += fmt::format(", {}, restart-ms {}, txqueuelen {}", rt::to_string(*link.state),
                      link.restart_ms.value_or(0), link.queue);
  if (*link.state == rt::CanBusState::kBusOff) {
    findings.push_back(device_failure(text,
                                      "check bit rate, wiring and termination (60 ohms between CAN_H and "
                                      "CAN_L), then: sudo ip link set " +
                                          name + " down, and up again"));
  } else if (*link.state != rt::CanBusState::kErrorActive) {
    findings.push_back(device_warning(
        text,
        "frames were not acknowledged or were disturbed: are the drives on, is the bit rate theirs, is "
        "the bus terminated at both ends?"));
  } else {
    findings.push_back(device_ok(text));
  }
  if (link.restart_ms.value_or(0) == 0) {
    findings.push_back(
        device_warning(what + ": restart-ms is 0: once off the bus it stays off",
                       fmt::format("sudo ip link set {} type can restart-ms 100 (while it is down)", name)));
  }
  return findings;
}

void examine_can(const Profile& profile, Findings& findings) {
  const SocketCanOptions& options = profile.backend.socketcan;
  const std::string what = "backend socketcan: " + options.interface;
  if (options.interface.starts_with(kUnix)) {
    const std::string emulate =
        fmt::format("start the drives' side: corbot-sim cia402 --can {}", options.interface);
    if (const auto fault = socket_fault(what, options.interface.substr(kUnix.size()), emulate)) {
      findings.push_back(*fault);
      return;
    }
  } else if (!examine_link(what, options, profile, findings)) {
    return;
  }
  const std::vector<Node> nodes = nodes_of(options);
  rt::DriveBus bus(options.interface, numbers_of(nodes), options.heartbeat_ms, profile.arm.period_ns);
  try {
    bus.open();
  } catch (const rt::DeviceError& error) {
    findings.push_back(device_failure(fmt::format("backend socketcan: {}", error.what()),
                                      options.interface.starts_with(kUnix)
                                          ? "start the drives' side: corbot-sim cia402"
                                          : "mend the fault of the line above first"));
    return;
  }
  for (const Node& node : nodes) {
    try {
      examine_node(what, node, rt::SdoClient(bus.port(), bus.watch(), node.number), findings);
    } catch (const rt::DeviceError& error) {
      findings.push_back(
          device_failure(fmt::format("backend socketcan: {}", error.what()),
                         "switch the drive on, and compare its node number and bit rate with the profile"));
      if (!bus.is_open() || error.cause() == DeviceCause::kBusDown) return;
    }
  }
}

}  // namespace corbot::cli
