// SPDX-License-Identifier: Apache-2.0
#include "cli/record.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <optional>
#include <utility>

#include "client/failure.h"
#include "client/notice.h"
#include "corbot/backend/backend.h"
#include "corbot/units.h"
#include "shm/channel_client.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::OnSignal;

namespace {

using Clock = std::chrono::steady_clock;
constexpr double kReadInterval_s = 0.02;            // the trace holds seconds: a late wake-up loses nothing
constexpr auto kSilence = std::chrono::seconds(1);  // without a cycle: check whether the robot is still up

const char* to_string(RtState state) {
  switch (state) {
    case RtState::kStandby:
      return "standby";
    case RtState::kMoving:
      return "moving";
    case RtState::kPaused:
      return "paused";
    case RtState::kStopping:
      return "stopping";
    case RtState::kError:
      return "error";
  }
  return "unknown";
}

const char* device_state(std::uint32_t health) {
  switch (static_cast<BackendHealth>(health)) {
    case BackendHealth::kClosed:
      return "closed";
    case BackendHealth::kOpen:
      return "open";
    case BackendHealth::kDegraded:
      return "degraded";
    case BackendHealth::kLost:
      return "lost";
    case BackendHealth::kStandby:
      return "standby";
  }
  return "unknown";
}

/// Returns text such as "unverified+power_off", or "-" if no flag is set.
std::string flags_text(std::uint32_t flags) {
  static constexpr std::pair<std::uint32_t, const char*> kNames[] = {
      {kSnapshotMeasured, "measured"},  {kSnapshotUnverified, "unverified"},     {kSnapshotHeld, "held"},
      {kSnapshotPowerOff, "power_off"}, {kSnapshotFaultStop, "fault_stop"},      {kSnapshotPaused, "paused"},
      {kSnapshotHolding, "holding"},    {kSnapshotHoldsNothing, "holds_nothing"}};
  std::string text;
  for (const auto& [bit, name] : kNames) {
    if ((flags & bit) != 0) text += (text.empty() ? "" : "+") + std::string(name);
  }
  return text.empty() ? "-" : text;
}

/// A file of rows, in order. A full disk can end it within a row.
class Output {
 public:
  Output(const std::string& file, bool force) : file_(file), fd_(STDOUT_FILENO) {
    if (file == "-") return;
    const int mode = force ? O_TRUNC : O_EXCL;
    fd_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | mode, 0644);
    if (fd_ >= 0) return;
    if (errno == EEXIST)
      throw Failure(ExitCode::kUsage,
                    file + " exists already: name another file, or overwrite this one with --force");
    throw Failure(ExitCode::kInternal, file + ": " + std::strerror(errno));
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  ~Output() {
    if (file_ != "-" && fd_ >= 0) ::close(fd_);
  }

  /// Returns false if the reader of a pipe has closed it.
  [[nodiscard]] bool write(const std::string& rows) const {
    for (std::size_t done = 0; done < rows.size();) {
      const ssize_t n = ::write(fd_, rows.data() + done, rows.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0 && errno == EPIPE) return false;
      if (n < 0) throw Failure(ExitCode::kInternal, fmt::format("{}: {}", file_, std::strerror(errno)));
      done += static_cast<std::size_t>(n);
    }
    return true;
  }

 private:
  std::string file_;
  int fd_;
};

/// Reads the flight recorder of a robot, across restarts of the task.
class Follower {
 public:
  explicit Follower(const std::string& robot)
      : robot_(robot), channel_(Observer::of(robot)), next_(channel_->task().trace.next()) {}

  /// Appends the rows since the last call.
  void read(std::string& rows, std::span<const JointKind> joints) {
    // Read first, so that the last rows of a task that ends are read, too.
    const bool lives = channel_ && channel_->task_alive();
    if (channel_) read_task(rows, joints);
    if (lives) return;
    channel_.reset();
    try {
      channel_.emplace(Observer::of(robot_));
    } catch (const SegmentError&) {
      return;  // gone, or not started yet
    }
    next_ = 0;
    ++restarts_;
    read_task(rows, joints);
  }
  /// Returns true if the robot is down. A task that was killed leaves its socket, and another task may start;
  /// one that ended has removed it.
  [[nodiscard]] bool gone() const {
    if (channel_ || Clock::now() - last_seen_ <= kSilence) return false;
    const auto directory = RunDirectory::open(false);
    return !directory || !std::filesystem::exists(directory->socket_path(robot_));
  }
  [[nodiscard]] std::string summary() const {
    std::string text = fmt::format("{} cycles recorded, {} lost", cycles_, lost_);
    if (restarts_ > 0) text += fmt::format("; the real-time task was restarted {} times", restarts_);
    return text;
  }

 private:
  void read_task(std::string& rows, std::span<const JointKind> joints) {
    const Trace& trace = channel_->task().trace;
    const std::uint64_t end = trace.next();
    if (end - next_ > Trace::capacity()) {
      lost_ += end - Trace::capacity() - next_;
      next_ = end - Trace::capacity();
    }
    Snapshot snapshot{};
    for (; next_ < end; ++next_) {
      if (!trace.read(next_, snapshot)) {
        ++lost_;
        continue;
      }
      rows += csv_row(snapshot, joints);
      ++cycles_;
      last_seen_ = Clock::now();
    }
  }

  const std::string robot_;
  std::optional<Observer> channel_;
  std::uint64_t next_;
  std::uint64_t cycles_{0};
  std::uint64_t lost_{0};
  std::uint64_t restarts_{0};
  Clock::time_point last_seen_{Clock::now()};
};

Follower follow(const std::string& name) {
  try {
    return Follower(name);
  } catch (const SegmentError& error) {
    const bool absent = error.kind() == SegmentError::Kind::kAbsent;
    throw Failure(absent ? ExitCode::kUnreachable : ExitCode::kInternal, error.what());
  }
}

}  // namespace

std::string csv_notes(const Profile& profile) {
  std::string text = fmt::format(
      "# profile '{}'; set-points of every cycle; docs/cli.md describes the columns\n", profile.name);
  for (std::size_t i = 0; i < profile.arm.dof; ++i) {
    const JointLimits& limits = profile.arm.joints[i];
    const bool turns = profile.arm.kinematics.joint_kind(i) == JointKind::kRotary;
    const double scale = turns ? to_degrees(1.0) : 1.0;
    const char* unit = turns ? "deg" : "m";
    text += fmt::format("# joint {} '{}': {:.6g} to {:.6g} {}, {:.6g} {}/s, {:.6g} {}/s2, {:.6g} {}/s3\n", i,
                        profile.joint_names[i], scale * limits.lower_q, scale * limits.upper_q, unit,
                        scale * limits.speed_q_s, unit, scale * limits.acceleration_q_s2, unit,
                        scale * limits.jerk_q_s3, unit);
  }
  return text;
}

std::string csv_header(std::span<const JointKind> joints) {
  std::string set_points, pulses, measured, speeds;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const bool turns = joints[i] == JointKind::kRotary;
    const std::string name = fmt::format("{}{}_{}", turns ? "theta" : "slide", i, turns ? "deg" : "m");
    set_points += "," + name;
    pulses += fmt::format(",pulse{}_us", i);
    measured += ",measured_" + name;
    speeds += fmt::format(",{}_s", name);
  }
  return "cycle,time_ns,wall_ns,state,command,rate" + set_points + ",x_m,y_m,z_m,gripper" + pulses +
         ",gripper_us,device,flags" + measured + speeds + "\n";
}

std::string csv_row(const Snapshot& s, std::span<const JointKind> joints) {
  std::string row;
  const auto out = std::back_inserter(row);
  const auto add_joints = [&](const Joints& values_q) {
    for (std::size_t i = 0; i < joints.size(); ++i) {
      if (joints[i] == JointKind::kRotary) {
        fmt::format_to(out, ",{:.9f}", to_degrees(values_q[i]));
      } else {
        fmt::format_to(out, ",{:.12f}", values_q[i]);
      }
    }
  };
  fmt::format_to(out, "{},{},{},{},{},{:.6g}", s.cycle, s.time_ns, s.wall_ns, to_string(s.state),
                 s.command_id, s.virtual_rate);
  add_joints(s.position_q);
  for (const double coordinate : s.tool.position_m) fmt::format_to(out, ",{:.12f}", coordinate);
  fmt::format_to(out, ",{:.6g}", s.gripper);
  for (std::size_t i = 0; i <= joints.size(); ++i) fmt::format_to(out, ",{:.3f}", s.pulse_us[i]);
  fmt::format_to(out, ",{},{}", device_state(s.device_health), flags_text(s.flags));
  if ((s.flags & kSnapshotMeasured) != 0) {
    add_joints(s.measured_q);
  } else {
    row.append(joints.size(), ',');
  }
  add_joints(s.velocity_q_s);
  return row + "\n";
}

void record(const RecordOptions& options, const OnSignal& on_signal) {
  Follower follower = follow(options.robot);
  const Output output(options.file, options.force);
  if (!output.write(options.notes + csv_header(options.joints))) return;
  client::notice(
      stderr, fmt::format("recording '{}' to {}{}\n", options.robot,
                          options.file == "-" ? "standard output" : options.file,
                          options.for_s > 0 ? fmt::format(" for {:g} s", options.for_s) : " until Ctrl-C"));
  const auto begin = Clock::now();
  std::string rows;
  std::string end;
  for (bool more = true; more;) {
    double pause = kReadInterval_s;
    if (options.for_s > 0) {
      const double left = options.for_s - std::chrono::duration<double>(Clock::now() - begin).count();
      pause = std::min(pause, left);
      more = left > 0;
    }
    if (on_signal.wait(pause)) more = false;
    rows.clear();
    follower.read(rows, options.joints);
    if (!output.write(rows)) break;
    if (more && follower.gone()) {
      end = "; the robot went down";
      more = false;
    }
  }
  client::notice(stderr, fmt::format("{}{}\n", follower.summary(), end));
}

}  // namespace corbot::cli
