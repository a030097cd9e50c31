// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <mutex>
#include <stop_token>
#include <vector>

#include "cell/scene_record.h"

namespace corbot::cell {

/// Writes the record of a run. The scene's loop only appends to a queue; another thread writes the file.
class SceneRecorder {
 public:
  SceneRecorder(std::filesystem::path file, SceneCast cast)
      : file_(std::move(file)), cast_(std::move(cast)) {}

  /// Queues a sample without waiting for the file. Drops it if the queue already holds a hundred seconds.
  void add(SceneSample sample);
  /// Writes the queue until a stop is requested and all samples are written. If the file cannot be written,
  /// the record ends with a warning in the log, and the work continues.
  void run(const std::stop_token& stop);

 private:
  [[nodiscard]] std::vector<SceneSample> take();

  const std::filesystem::path file_;
  const SceneCast cast_;
  std::mutex mutex_;
  std::vector<SceneSample> queue_;
};

}  // namespace corbot::cell
