// SPDX-License-Identifier: Apache-2.0
#include "robot/control.h"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "robot/call_error.h"

namespace corbot {
namespace {

/// Throws CallError (internal) where the kernel has no random bytes.
std::string random_key() {
  std::array<std::uint8_t, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw internal("the kernel gives no random bytes for a key");
  std::string key;
  for (const std::uint8_t byte : bytes) key += fmt::format("{:02x}", byte);
  return key;
}

/// Compares in a time that does not depend on where the two differ.
bool is_same(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned char>(a[i] ^ b[i]);
  return difference == 0;
}

bool is_printable(char c) { return c >= ' ' && c <= '~'; }

}  // namespace

Control::Control(std::function<void()> on_end) : on_end_(std::move(on_end)), thread_([this] { run(); }) {}

Control::~Control() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

Control::Use::~Use() {
  if (control_ != nullptr) control_->end_use(number_);
}

std::string Control::acquire(const std::string& who, double lease_s) {
  if (!(lease_s >= kShortestLease_s && lease_s <= kLongestLease_s))
    throw bad_argument(
        "lease", lease_s,
        fmt::format("{:.6g} s, allowed {:g} to {:g} s", lease_s, kShortestLease_s, kLongestLease_s));
  if (who.empty() || who.size() > kLongestName || !std::all_of(who.begin(), who.end(), is_printable))
    throw bad_argument(
        "who", static_cast<double>(who.size()),
        fmt::format("a name of 1 to {} printable ASCII characters, this has {}", kLongestName, who.size()));
  std::string key = random_key();
  const std::lock_guard lock(mutex_);
  if (state_) throw not_ready(describe());
  const auto lease = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(lease_s));
  state_ = State{++acquisitions_, who, key, lease, Clock::now() + lease};
  changed_.notify_all();
  return key;
}

Control::State& Control::held_by(const std::string& key) {
  if (!state_ || state_->ending || !is_same(state_->key, key))
    throw not_ready("control has ended: the lease ran out or was released; Acquire gives it again");
  return *state_;
}

void Control::renew(const std::string& key) {
  const std::lock_guard lock(mutex_);
  State& state = held_by(key);
  state.until = Clock::now() + state.lease;
}

void Control::release(const std::string& key) {
  std::unique_lock lock(mutex_);
  (void)held_by(key);
  end(lock);
}

void Control::end(std::unique_lock<std::mutex>& lock) {
  state_->ending = true;
  lock.unlock();
  on_end_();
  lock.lock();
  state_.reset();
  changed_.notify_all();
}

std::optional<Control::Holder> Control::holder() const {
  const std::lock_guard lock(mutex_);
  if (!state_) return std::nullopt;
  return Holder{state_->who, left_s()};
}

double Control::left_s() const {
  if (state_->uses > 0) return std::chrono::duration<double>(state_->lease).count();
  return std::max(0.0, std::chrono::duration<double>(state_->until - Clock::now()).count());
}

std::string Control::describe() const {
  if (state_->ending)
    return fmt::format("'{}' is giving control back, the arm is being stopped", state_->who);
  return fmt::format("'{}' has control of the arm, for another {:.1f} s unless renewed", state_->who,
                     left_s());
}

Control::Use Control::use(const std::string& key) {
  const std::lock_guard lock(mutex_);
  if (key.empty()) {
    if (state_) throw not_ready(describe());
    return Use(nullptr, 0);
  }
  State& state = held_by(key);
  ++state.uses;
  return Use(this, state.number);
}

void Control::end_use(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  // Control may have been released meanwhile, and acquired by another.
  if (!state_ || state_->number != number) return;
  --state_->uses;
  state_->until = Clock::now() + state_->lease;
  changed_.notify_all();
}

void Control::run() {
  std::unique_lock lock(mutex_);
  while (!closing_) {
    if (!state_ || state_->ending || state_->uses > 0) {
      changed_.wait(lock);
    } else if (Clock::now() >= state_->until) {
      end(lock);
    } else {
      changed_.wait_until(lock, state_->until);
    }
  }
}

}  // namespace corbot
