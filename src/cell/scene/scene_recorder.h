// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <mutex>
#include <stop_token>
#include <vector>

#include "cell/scene_record.h"

namespace corbot::cell {

/// Writes the record of a run. The scene's loop only appends to a queue; the file is another thread's.
class SceneRecorder {
 public:
  SceneRecorder(std::filesystem::path file, SceneCast cast)
      : file_(std::move(file)), cast_(std::move(cast)) {}

  /// Waits for no file. Samples beyond a hundred seconds that are not yet written are left out.
  void add(SceneSample sample);
  /// Writes what has come, until a stop is requested and all is written. A file that cannot be written is a
  /// warning in the log, and the end of the record: the work goes on.
  void run(const std::stop_token& stop);

 private:
  [[nodiscard]] std::vector<SceneSample> take();

  const std::filesystem::path file_;
  const SceneCast cast_;
  std::mutex mutex_;
  std::vector<SceneSample> queue_;
};

}  // namespace corbot::cell
