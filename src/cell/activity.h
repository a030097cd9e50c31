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
  kIdle,             ///< before and after the work, in a pause, or waiting for a person
  kMoving,           ///< arm or gripper moves
  kWaitingForZone,   ///< another robot is in it
  kLooking,          ///< at rest while the camera takes a picture
  kWaitingForPiece,  ///< there is no piece to take, or no free slot
};

/// A robot's activity from `time_s` until the robot's next change.
struct ActivityChange {
  double time_s{};  ///< Unix epoch
  std::string robot;
  Activity activity{Activity::kIdle};
  std::uint64_t piece{0};  ///< number of the piece in work; 0: none
  std::string zone{};      ///< shared place whose zone the robot is in; empty: none

  bool operator==(const ActivityChange&) const = default;
};

/// Returns one JSON object without a newline.
[[nodiscard]] std::string to_line(const ActivityChange& change);
/// Parses a line of to_line(). Returns nothing if the line is truncated or invalid.
[[nodiscard]] std::optional<ActivityChange> parse_activity(std::string_view line);
/// Returns all changes of a record by time. Skips invalid lines. Returns none if the file does not exist.
[[nodiscard]] std::vector<ActivityChange> read_activity(const std::filesystem::path& file);

/// Appends one line for each change to a record. The work does not depend on the record: a line that cannot
/// be written is lost. Any thread may call it.
class ActivityRecord {
 public:
  explicit ActivityRecord(std::filesystem::path file) : file_(std::move(file)) {}
  void add(const ActivityChange& change);

 private:
  const std::filesystem::path file_;
  std::mutex mutex_;
};

}  // namespace corbot::cell
