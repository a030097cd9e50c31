// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

// The record of a simulated run: where arms and pieces were. corbot-scene writes it, and pictures for
// people come from it. It is text, a JSON object a line. The first line names arms and pieces. Each later
// one has its time and what has changed since the line before. Lengths are rounded to 0.1 mm. World frame,
// metres, radians, seconds.

namespace corbot::cell {

struct RecordedArm {
  std::vector<Eigen::Vector3d> points_m;  ///< ends of the links, from the base to the tool centre point
  double opening_m{};                     ///< between the fingers
  double across_rad{};                    ///< direction, from above, in which the fingers close
  bool operator==(const RecordedArm&) const = default;
};

struct RecordedPiece {
  Eigen::Vector3d foot_m{Eigen::Vector3d::Zero()};
  std::optional<std::size_t> hand;  ///< the arm that holds it
  bool is_fallen{false};
  bool operator==(const RecordedPiece&) const = default;
};

struct SceneSample {
  double time_s{};
  std::vector<RecordedArm> arms;
  std::vector<RecordedPiece> pieces;
};

/// What does not change during a run.
struct SceneCast {
  struct Arm {
    std::string name;
    std::vector<double> radii_m;  ///< of its links
  };
  std::vector<Arm> arms;
  std::vector<std::string> kinds;  ///< of each piece
};

struct SceneRecord {
  SceneCast cast;
  std::vector<SceneSample> samples;
  bool is_cut{false};  ///< the run went on after the last sample
};

/// Below the state directory of a cell.
[[nodiscard]] inline std::filesystem::path scene_record_file(const std::filesystem::path& state_directory) {
  return state_directory / "scene.record";
}

/// Makes the text of a record, line by line. It ends before `limit_bytes`, and its last line says so.
class SceneRecordText {
 public:
  /// 20 minutes and more of two arms that always move.
  static constexpr std::size_t kLimit_bytes = 16'000'000;
  explicit SceneRecordText(std::size_t limit_bytes = kLimit_bytes) : limit_bytes_(limit_bytes) {}

  [[nodiscard]] std::string begin(const SceneCast& cast);
  /// The lines to append; empty where nothing has changed, and after the end of the record.
  [[nodiscard]] std::string add(SceneSample sample);
  /// The time of the last sample, where nothing has changed since the last line.
  [[nodiscard]] std::string end();

 private:
  [[nodiscard]] std::string counted(std::string text);

  std::size_t limit_bytes_;
  std::size_t bytes_{0};
  bool is_cut_{false};
  std::optional<double> unwritten_s_;  ///< a sample at which nothing had changed
  SceneSample last_;
};

/// Every sample is complete. Reads up to a line that is not whole, as a killed scene leaves it. Throws
/// client::Failure where the text is no record.
[[nodiscard]] SceneRecord read_scene_record(std::istream& text);

}  // namespace corbot::cell
