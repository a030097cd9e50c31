// SPDX-License-Identifier: Apache-2.0
#include "cell/scene/scene_recorder.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <fstream>
#include <thread>
#include <utility>

namespace corbot::cell {
namespace {

constexpr std::size_t kLongestQueue = 2000;
constexpr std::chrono::milliseconds kBetweenWrites{200};

}  // namespace

void SceneRecorder::add(SceneSample sample) {
  const std::lock_guard lock(mutex_);
  if (queue_.size() < kLongestQueue) queue_.push_back(std::move(sample));
}

std::vector<SceneSample> SceneRecorder::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(queue_, {});
}

void SceneRecorder::run(const std::stop_token& stop) {
  std::ofstream file(file_);
  SceneRecordText text;
  file << text.begin(cast_);
  for (bool is_last = false; !is_last && file.flush();) {
    std::this_thread::sleep_for(kBetweenWrites);
    is_last = stop.stop_requested();
    for (SceneSample& sample : take()) file << text.add(std::move(sample));
    if (is_last) file << text.end();
  }
  if (!file.flush()) spdlog::warn("{} cannot be written: the record of this run ends here", file_.string());
}

}  // namespace corbot::cell
