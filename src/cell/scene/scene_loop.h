// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

#include "cell/scene/scene.h"
#include "sim/devices/control_input.h"

namespace corbot::cell {

/// Runs a scene in real time in one thread: ticks at absolute times, and the controllers' sockets between
/// them. After a delay the ticks that are due are simulated one by one, and what has come in meanwhile counts
/// as come now.
class SceneLoop {
 public:
  /// `on_sample` is called in this thread, `kSample_ns` apart until the first command, and must not wait. `input` has lines
  /// for Scene::command(); null: there are none.
  explicit SceneLoop(Scene& scene, std::function<void(SceneSample)> on_sample = {},
                     sim::ControlInput* input = nullptr)
      : scene_(scene), on_sample_(std::move(on_sample)), input_(input) {}
  static constexpr std::int64_t kSample_ns = 50'000'000;

  /// Simulates until a stop is requested.
  void run(const std::stop_token& stop);

  /// The scene at a tick that begins after this call; nothing where there is none within `wait`. From another
  /// thread.
  [[nodiscard]] std::optional<SceneView> look(std::chrono::milliseconds wait);
  /// Wake-ups that came a tick or more too late. After the end of run().
  [[nodiscard]] std::uint64_t overruns() const { return overruns_; }

 private:
  void wait_for_input(std::int64_t until_ns);
  void tick_until(std::int64_t now_ns);
  void answer_look();

  Scene& scene_;
  const std::function<void(SceneSample)> on_sample_;
  sim::ControlInput* const input_;
  std::int64_t next_tick_ns_{0};
  std::int64_t next_sample_ns_{0};
  std::uint64_t overruns_{0};

  std::mutex mutex_;
  std::condition_variable looked_;
  std::int64_t asked_ns_{0};  ///< time of the last look; guarded by the mutex, as the next line
  SceneView view_;            ///< the last one that a look asked for
};

}  // namespace corbot::cell
