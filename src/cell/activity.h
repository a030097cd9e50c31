// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// The record of what each robot of a cell does: the coordinator writes it, reports read it.

namespace corbot::cell {

enum class Activity {
  kIdle,             ///< before the work, after it, in a pause, or when a person is needed
  kMoving,           ///< arm or gripper
  kWaitingForZone,   ///< another robot is in it
  kLooking,          ///< at rest, for a picture
  kWaitingForPiece,  ///< there is no piece to take, or no free slot
};

/// From `time_s` on this is so for the robot, until its next change.
struct ActivityChange {
  double time_s{};  ///< Unix epoch
  std::string robot;
  Activity activity{Activity::kIdle};
  std::uint64_t piece{0};  ///< 0: it has none in work
  std::string zone{};      ///< the shared place whose zone it is in

  bool operator==(const ActivityChange&) const = default;
};

/// One JSON object, without the end of the line.
[[nodiscard]] std::string to_line(const ActivityChange& change);
/// Nothing where the line is cut or is none of to_line().
[[nodiscard]] std::optional<ActivityChange> parse_activity(std::string_view line);
/// All changes of a record, by time. Lines that are none are left out. Empty where there is no such file.
[[nodiscard]] std::vector<ActivityChange> read_activity(const std::filesystem::path& file);

/// Appends to a record, a line each. The work does not depend on it: a line that the disk does not take is
/// left out.
/// Any thread may call it.
class ActivityRecord {
 public:
  explicit ActivityRecord(std::filesystem::path file) : file_(std::move(file)) {}
  void add(const ActivityChange& change);

 private:
  const std::filesystem::path file_;
  std::mutex mutex_;
};

}  // namespace corbot::cell
