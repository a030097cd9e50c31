// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

// The record of a simulated run: positions of arms and pieces over time. corbot-scene writes the record, and
// pictures for people are made from it. Each line of the text is a JSON object. The first line names arms and
// pieces. Each later line has its time and the changes since the previous line. Lengths are rounded to 0.1
// mm. World frame, metres, radians, seconds.

namespace corbot::cell {

struct RecordedArm {
  std::vector<Eigen::Vector3d> points_m;  ///< ends of the links, from the base to the tool centre point
  double opening_m{};                     ///< distance between the fingers
  double across_rad{};                    ///< direction in which the fingers close, seen from above
  bool operator==(const RecordedArm&) const = default;
};

struct RecordedPiece {
  Eigen::Vector3d foot_m{Eigen::Vector3d::Zero()};
  std::optional<std::size_t> hand;  ///< the arm that holds it
  bool is_fallen{false};
  double yaw_rad{0};  ///< square: direction of a side
  bool operator==(const RecordedPiece&) const = default;
};

struct SceneSample {
  double time_s{};
  std::vector<RecordedArm> arms;
  std::vector<RecordedPiece> pieces;
};

/// The arms and pieces of a run, which do not change.
struct SceneCast {
  struct Arm {
    std::string name;
    std::vector<double> radii_m;  ///< radii of the links
  };
  std::vector<Arm> arms;
  std::vector<std::string> kinds;  ///< kind of each piece
};

struct SceneRecord {
  SceneCast cast;
  std::vector<SceneSample> samples;
  bool is_cut{false};  ///< the run went on after the last sample
};

/// Returns the record's path in the state directory of a cell.
[[nodiscard]] inline std::filesystem::path scene_record_file(const std::filesystem::path& state_directory) {
  return state_directory / "scene.record";
}

/// Makes the text of a record, line by line. A text that reaches `limit_bytes` ends with a line that says so.
class SceneRecordText {
 public:
  /// The limit holds at least 20 minutes of two arms that always move.
  static constexpr std::size_t kLimit_bytes = 16'000'000;
  explicit SceneRecordText(std::size_t limit_bytes = kLimit_bytes) : limit_bytes_(limit_bytes) {}

  [[nodiscard]] std::string begin(const SceneCast& cast);
  /// Returns the lines to append; empty if nothing has changed, and after the end of the record.
  [[nodiscard]] std::string add(SceneSample sample);
  /// Returns the last sample's time as a line if nothing has changed since the previous line.
  [[nodiscard]] std::string end();

 private:
  [[nodiscard]] std::string counted(std::string text);

  std::size_t limit_bytes_;
  std::size_t bytes_{0};
  bool is_cut_{false};
  std::optional<double> unwritten_s_;  ///< time of the last sample, without a change
  SceneSample last_;
};

/// Reads a record into complete samples. Stops at a truncated line, which a killed scene may leave. Throws
/// client::Failure if the text is not a record.
[[nodiscard]] SceneRecord read_scene_record(std::istream& text);

}  // namespace corbot::cell
