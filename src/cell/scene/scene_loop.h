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

/// Runs a scene in real time in one thread. Ticks are at absolute times; the loop serves the controllers'
/// sockets between them. After a delay the loop simulates the due ticks one by one. Requests received
/// meanwhile count as received after them.
class SceneLoop {
 public:
  /// run() calls `on_sample` every `kSample_ns` until the first command that changes pieces; the function
  /// must not block. `input` gives lines for Scene::command(); null: none.
  explicit SceneLoop(Scene& scene, std::function<void(SceneSample)> on_sample = {},
                     sim::ControlInput* input = nullptr)
      : scene_(scene), on_sample_(std::move(on_sample)), input_(input) {}
  static constexpr std::int64_t kSample_ns = 50'000'000;

  /// Simulates until a stop is requested.
  void run(const std::stop_token& stop);

  /// Returns the scene at a tick that begins after this call, or nothing if there is none within `wait`. Call
  /// it from another thread than run().
  [[nodiscard]] std::optional<SceneView> look(std::chrono::milliseconds wait);
  /// Returns the number of wake-ups at least one tick late. Call it after run() has returned.
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
  std::int64_t asked_ns_{0};  ///< time of the last look; the mutex guards it and view_
  SceneView view_;            ///< last view for a look
};

}  // namespace corbot::cell
