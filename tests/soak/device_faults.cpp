// SPDX-License-Identifier: Apache-2.0
#include "soak/device_faults.h"

#include <fmt/format.h>
#include <signal.h>

#include <utility>

namespace corbot::soak {
namespace {

// From a fault to the Error, on a machine that runs: see docs/wiring.
constexpr double kPress_s = 0.5;
constexpr double kCut_s = 0.5;
constexpr double kSilence_s = 1.0;
constexpr double kDrive_s = 0.5;

DeviceFault fault(std::string what, std::vector<std::string> alarms, double error_within_s = 0.0,
                  std::string name = "", bool is_heard = true) {
  DeviceFault made;
  made.what = std::move(what);
  made.alarms = std::move(alarms);
  made.error_within_s = error_within_s;
  made.name = std::move(name);
  made.is_heard = is_heard;
  return made;
}

}  // namespace

Trouble Troubles::told(DeviceFault fault, const std::string& on, const std::string& off, double lasts_s) {
  Trouble trouble{std::move(fault)};
  trouble.begin = [this, on] { rig_.command(on); };
  if (!off.empty()) trouble.undo = [this, off] { rig_.command(off); };
  trouble.lasts_s = lasts_s;
  return trouble;
}

/// Draws one of the faults that any serial controller may have.
Trouble Troubles::of_serial(std::vector<std::string> alarms) {
  switch (between(0, 4)) {
    case 0:
      return told(fault("silent", std::move(alarms), kSilence_s, "", false), "silent on", "silent off",
                  duration());
    case 1:
      return told(fault("unplug", std::move(alarms), kCut_s, "", false), "unplug", "plug", duration());
    case 2:
      return told(fault("reset", std::move(alarms)), "reset", "", real(0.1, 1.0));
    case 3:
      return told(fault("drop bytes", std::move(alarms), 0.0, "", false),
                  fmt::format("drop {}", between(1, 200)), "drop 0", real(0.1, 0.6));
    default:
      return told(fault("garble bytes", std::move(alarms)), fmt::format("garble {}", between(1, 60)),
                  "garble 0", real(0.1, 0.6));
  }
}

/// The device answers one kind of query badly, the others as ever. It garbles no positions: corbot cannot
/// tell such a controller from one that sends other pulses.
Trouble Troubles::of_query(const std::vector<const char*>& queries, std::vector<std::string> alarms) {
  const std::string query =
      queries[static_cast<std::size_t>(between(0, static_cast<int>(queries.size()) - 1))];
  // Unheard, the stop input has a deadline of its own; what is asked in every frame is missed soon.
  const bool is_input = query == "input";
  const double within_s = is_input ? kPress_s : query == "position" ? kSilence_s : 0.0;
  const auto switched = [&](const char* how, double error_within_s) {
    DeviceFault made = fault(fmt::format("{} {}", how, query), std::move(alarms), error_within_s,
                             is_input && error_within_s > 0.0 ? "130 " : "");
    return told(std::move(made), fmt::format("{} {} on", how, query), fmt::format("{} {} off", how, query),
                duration());
  };
  switch (between(0, 4)) {
    case 0:
      return switched("deaf", within_s);
    case 1:
      return query == "position" ? switched("deaf", within_s) : switched("garble", within_s);
    case 2:
      return switched("half", within_s);
    case 3:
      return told(fault("lose answers to " + query, std::move(alarms)),
                  fmt::format("lose {} {}", query, between(2, 20)), fmt::format("lose {} 0", query),
                  duration());
    default:
      return told(fault("late answers to " + query, std::move(alarms)),
                  fmt::format("delay {} {}", query, between(1, 300)), fmt::format("delay {} 0", query),
                  duration());
  }
}

Trouble Troubles::of_ssc32() {
  if (between(0, 3) == 0) return of_query({"position", "input", "moving", "version"}, {"121 ", "130 "});
  if (between(0, 2) == 0)
    return told(fault("press", {"130 "}, kPress_s, "130 "), "input A 1", "input A 0", duration());
  return of_serial({"121 ", "130 "});
}

Trouble Troubles::of_maestro() {
  if (between(0, 3) == 0) return of_query({"position", "moving", "errors"}, {"121 "});
  return of_serial({"121 "});
}

Trouble Troubles::of_drives() {
  const int node = between(1, 5);
  const auto on_node = [&](const char* what, const char* words, double within_s, const char* name,
                           bool is_heard = true) {
    DeviceFault made = fault(what, {"121 ", "104 ", "105 "}, within_s, name, is_heard);
    return told(std::move(made), fmt::format("{} on {}", words, node), fmt::format("{} off {}", words, node),
                duration());
  };
  switch (between(0, 11)) {
    case 10:
    case 11: {  // objects that are read, or written, at a start, after a loss and where a fault is examined
      static constexpr const char* kObjects[] = {"1000", "1018:1", "603F", "6060", "60C2:1", "1016:1"};
      const char* object = kObjects[between(0, 5)];
      return told(fault(fmt::format("unanswered {}", object), {"121 "}),
                  fmt::format("unanswered {} on {}", object, node),
                  fmt::format("unanswered {} off {}", object, node), duration());
    }
    case 0:
    case 1:
      return on_node("STO", "sto", kDrive_s, "STO");
    case 2:
    case 3:
      return on_node("blocked drive", "block", 0.0, "");
    case 4:
      return on_node("ignoring drive", "ignore", kDrive_s, "121 ");
    case 5:
      return on_node("silent drive", "silent", kSilence_s, "121 ", false);
    case 6:
      return on_node("mute drive", "mute", 0.0, "", false);
    case 7:
      return told(fault("fault of a drive", {"121 "}, kDrive_s, "121 "), fmt::format("emcy 3210 {}", node),
                  "", real(0.1, 1.0));
    case 8:
      return told(fault("reset of a drive", {"121 "}, 0.0, "", false), fmt::format("reset {}", node), "",
                  real(0.1, 1.0));
    default:
      return told(fault("unplug", {"121 "}, kCut_s, "121 ", false), "unplug", "plug", duration());
  }
}

Trouble Troubles::of_emulator(std::vector<std::string> alarms) {
  Trouble trouble;
  trouble.is_emulator = true;
  trouble.lasts_s = duration();
  // Drives that begin anew count from 0: to corbot others, which need a person with the maker's tool.
  if (rig_.kind() != DeviceKind::kCia402 && between(0, 1) == 0) {
    trouble.fault = fault("kill emulator", std::move(alarms), kSilence_s, "", false);
    trouble.begin = [this] { rig_.kill(); };
    trouble.undo = [this] { rig_.start(); };
  } else {
    trouble.fault = fault("freeze emulator", std::move(alarms), kSilence_s, "", false);
    trouble.begin = [this] { rig_.freeze(true); };
    trouble.undo = [this] { rig_.freeze(false); };
  }
  return trouble;
}

Trouble Troubles::kill(const char* what, pid_t pid, std::vector<std::string> alarms) {
  Trouble trouble{fault(fmt::format("kill {}", what), std::move(alarms), 0.0, "", false)};
  trouble.begin = [pid] {
    if (pid > 0) ::kill(pid, SIGKILL);
  };
  return trouble;
}

Trouble Troubles::freeze(const char* what, pid_t pid, std::vector<std::string> alarms) {
  Trouble trouble{fault(fmt::format("freeze {}", what), std::move(alarms), 0.0, "", false)};
  trouble.begin = [pid] {
    if (pid > 0) ::kill(pid, SIGSTOP);
  };
  trouble.undo = [pid] {
    if (pid > 0) ::kill(pid, SIGCONT);
  };
  trouble.lasts_s = duration();
  return trouble;
}

Trouble Troubles::of_device() {
  const bool has_input = rig_.kind() == DeviceKind::kSsc32;
  if (between(0, 7) == 0)
    return of_emulator(has_input ? std::vector<std::string>{"121 ", "130 "}
                                 : std::vector<std::string>{"121 "});
  switch (rig_.kind()) {
    case DeviceKind::kSsc32:
      return of_ssc32();
    case DeviceKind::kMaestro:
      return of_maestro();
    case DeviceKind::kCia402:
      break;
  }
  return of_drives();
}

Trouble Troubles::of_process() {
  // A task that stands still asks its device nothing, and its drives notice.
  const std::vector<std::string> of_task{"121 ", "130 ", "131 ", "141 ", "142 "};
  switch (between(0, 3)) {
    case 0:
      return kill("task", stage_.task(), of_task);
    case 1:
      return freeze("task", stage_.task(), of_task);
    case 2:
      return kill("servant", stage_.servant(), {});
    default:
      return freeze("servant", stage_.servant(), {});
  }
}

}  // namespace corbot::soak
