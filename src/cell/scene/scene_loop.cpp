// SPDX-License-Identifier: Apache-2.0
#include "cell/scene/scene_loop.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>

#include "client/failure.h"

namespace corbot::cell {
namespace {

/// The longest delay whose ticks are simulated later. The loop skips the time before, for example after a
/// suspend.
constexpr std::int64_t kLongestCatchUp_ns = 10'000'000'000;

}  // namespace

void SceneLoop::run(const std::stop_token& stop) {
  next_tick_ns_ = sim::clock_ns();
  tick_until(next_tick_ns_);
  while (!stop.stop_requested()) {
    wait_for_input(std::min(next_tick_ns_, scene_.next_answer_ns().value_or(next_tick_ns_)));
    const std::int64_t now_ns = sim::clock_ns();
    if (now_ns - next_tick_ns_ >= Scene::kTick_ns) ++overruns_;
    next_tick_ns_ = std::max(next_tick_ns_, now_ns - kLongestCatchUp_ns);
    tick_until(now_ns);
    scene_.exchange(now_ns);
  }
}

void SceneLoop::tick_until(std::int64_t now_ns) {
  bool has_ticked = false;
  for (; next_tick_ns_ <= now_ns; next_tick_ns_ += Scene::kTick_ns) {
    scene_.tick(next_tick_ns_);
    has_ticked = true;
    if (on_sample_ && !scene_.is_changed() && next_tick_ns_ >= next_sample_ns_) {
      on_sample_(scene_.sample());
      next_sample_ns_ = next_tick_ns_ + kSample_ns;
    }
  }
  if (has_ticked) answer_look();
}

void SceneLoop::wait_for_input(std::int64_t until_ns) {
  std::vector<pollfd> fds;
  if (input_ != nullptr) fds.push_back({input_->fd(), POLLIN, 0});
  scene_.add_to(fds);
  const std::int64_t left_ns = std::max<std::int64_t>(until_ns - sim::clock_ns(), 0);
  const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  if (::ppoll(fds.data(), fds.size(), &left, nullptr) < 0 && errno != EINTR)
    throw client::system_failure("poll", errno);
  if (input_ == nullptr || fds[0].revents == 0) return;
  input_->read([&](std::string_view line) { return scene_.command(line); });
  std::fflush(stdout);
}

void SceneLoop::answer_look() {
  const std::lock_guard lock(mutex_);
  if (asked_ns_ <= view_.time_ns) return;
  view_ = scene_.view();
  looked_.notify_all();
}

std::optional<SceneView> SceneLoop::look(std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  const std::int64_t asked_ns = sim::clock_ns();
  asked_ns_ = asked_ns;
  if (!looked_.wait_for(lock, wait, [&] { return view_.time_ns >= asked_ns; })) return std::nullopt;
  return view_;
}

}  // namespace corbot::cell
