// SPDX-License-Identifier: Apache-2.0
#include "robot/control.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/sha.h>
#include <pthread.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "corbot/running_time.h"
#include "robot/call_error.h"

namespace corbot {
namespace {

/// Returns a new key. Throws CallError (internal) if the kernel has no random bytes.
std::string random_key() {
  std::array<std::uint8_t, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw internal("the kernel gives no random bytes for a key");
  std::string key;
  for (const std::uint8_t byte : bytes) key += fmt::format("{:02x}", byte);
  return key;
}

/// Returns the digest of the key. The key has 128 random bits, so the digest needs no salt and does not
/// reveal it.
decltype(ControlRecord::key_digest) digest_of(const std::string& key) {
  decltype(ControlRecord::key_digest) digest{};
  static_assert(sizeof(digest) == SHA256_DIGEST_LENGTH);
  ::SHA256(reinterpret_cast<const unsigned char*>(key.data()), key.size(), digest.data());
  return digest;
}

/// Returns the holder's name, or "" if the text has no terminating zero.
std::string name_in(const ControlRecord& record) {
  const auto end = std::find(record.who.begin(), record.who.end(), '\0');
  return end == record.who.end() ? std::string() : std::string(record.who.begin(), end);
}

std::chrono::nanoseconds nanoseconds(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
}

}  // namespace

Control::Control(DurableCell<ControlRecord>& kept, OnEnd on_end)
    : on_end_(std::move(on_end)), kept_(kept), thread_([this] { run(); }) {}

void Control::close() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

bool Control::is_valid(const ControlRecord& record) {
  const std::chrono::nanoseconds lease(record.lease_ns);
  // A record without a name was stored when control ended: no client has control.
  if (record.who[0] == '\0') return true;
  return is_holder_name(name_in(record)) && lease >= nanoseconds(kShortestLease_s) &&
         lease <= nanoseconds(kLongestLease_s);
}

void Control::inherit(const ControlRecord& record) {
  if (record.who[0] == '\0') return;
  const std::lock_guard lock(mutex_);
  if (state_) return;
  const Clock::duration lease = std::chrono::nanoseconds(record.lease_ns);
  const Clock::time_point now = Clock::now();
  const Clock::time_point until{std::chrono::nanoseconds(record.until_ns)};  // can be any number
  state_ = State{++acquisitions_, name_in(record), record.key_digest, lease,
                 record.in_use != 0 ? now + lease : std::clamp(until, now, now + lease)};
  state_->may_expire = false;
  keep();
}

void Control::allow_expiry() {
  const std::lock_guard lock(mutex_);
  if (!state_) return;
  state_->may_expire = true;
  changed_.notify_all();
}

void Control::keep() {
  ControlRecord record{};
  static_assert(kLongestHolderName < sizeof(record.who) && kLongestHolderName < sizeof(corbot_holder::who));
  if (state_) {
    std::copy(state_->who.begin(), state_->who.end(), record.who.begin());
    record.key_digest = state_->key_digest;
    record.lease_ns = std::chrono::nanoseconds(state_->lease).count();
    record.until_ns = std::chrono::nanoseconds(state_->until.time_since_epoch()).count();
    record.in_use = state_->uses > 0 ? 1 : 0;
  }
  kept_.store(record);
}

Control::Use::~Use() {
  if (control_ != nullptr) control_->end_use(number_);
}

/// Waits until all calls that were admitted before control was taken have returned.
void Control::await_alone(std::unique_lock<std::mutex>& lock, const Wanted& wanted) {
  constexpr std::chrono::milliseconds kLook{5};
  for (Patience patience{kCallsEnd};;) {
    const bool is_last = patience.is_over();
    const bool alone = changed_.wait_for(lock, kLook, [this] { return public_uses_ == 0 || closing_; });
    if (closing_) throw not_ready("the servant is shutting down");
    if (alone) return;
    if (is_last) throw not_ready("calls of others are still being carried out");
    lock.unlock();
    check(wanted);
    lock.lock();
  }
}

std::string Control::acquire(const std::string& who, double lease_s, const Admit& admit,
                             const Wanted& wanted) {
  if (!(lease_s >= kShortestLease_s && lease_s <= kLongestLease_s))
    throw bad_argument(
        "lease", lease_s,
        fmt::format("{:.6g} s, allowed {:g} to {:g} s", lease_s, kShortestLease_s, kLongestLease_s));
  if (!is_holder_name(who))
    throw bad_argument("who", static_cast<double>(who.size()),
                       fmt::format("a name of 1 to {} printable ASCII characters, this has {}",
                                   kLongestHolderName, who.size()));
  std::string key = random_key();
  const Clock::duration lease = nanoseconds(lease_s);
  std::unique_lock lock(mutex_);
  if (state_) throw not_ready(describe());
  lock.unlock();
  admit();
  lock.lock();
  if (state_) throw not_ready(describe());
  // Refuses all other clients from now on. No client knows the key yet, and the lease does not run.
  State& state = state_.emplace(State{++acquisitions_, who, digest_of(key), lease, Clock::now() + lease});
  state.uses = 1;
  state.beginning = true;
  try {
    await_alone(lock, wanted);
    lock.unlock();
    admit();
    lock.lock();
  } catch (...) {
    if (!lock.owns_lock()) lock.lock();
    state_.reset();
    changed_.notify_all();
    throw;
  }
  state.uses = 0;
  state.beginning = false;
  state.until = Clock::now() + lease;
  keep();
  changed_.notify_all();
  return key;
}

/// Returns true if the lease has run out, even if the thread that ends it is late.
bool Control::has_run_out() const {
  return state_->uses == 0 && state_->may_expire && Clock::now() >= state_->until;
}

bool Control::has_key(const std::string& key) const {
  if (!state_ || state_->ending || has_run_out()) return false;
  // The comparison takes the same time wherever the digests differ.
  return ::CRYPTO_memcmp(state_->key_digest.data(), digest_of(key).data(), state_->key_digest.size()) == 0;
}

Control::State& Control::held_by(const std::string& key) {
  if (key.empty())
    throw not_ready(
        "this reference never had control of the arm: it is for the one that Acquire has returned");
  if (!has_key(key))
    throw not_ready(
        "control has ended, as the lease ran out or it was released, or this reference never had it: Acquire "
        "gives it, and the robot's own address works without it");
  return *state_;
}

void Control::renew(const std::string& key) {
  const std::lock_guard lock(mutex_);
  State& state = held_by(key);
  state.until = Clock::now() + state.lease;
  keep();
}

void Control::release(const std::string& key, const Wanted& wanted) {
  std::unique_lock lock(mutex_);
  (void)held_by(key);
  give_up(lock, wanted);
}

void Control::end_by_force() {
  std::unique_lock lock(mutex_);
  if (!state_) throw not_ready("no client has control of the arm");
  if (state_->beginning || state_->ending) throw not_ready(describe());
  give_up(lock, {});
}

void Control::give_up(std::unique_lock<std::mutex>& lock, const Wanted& wanted) {
  const std::string failure = end(lock, true, wanted);
  if (!failure.empty())
    throw not_ready("control has ended, but the servant cannot confirm that the arm has stopped: " + failure);
}

std::string Control::end(std::unique_lock<std::mutex>& lock, bool is_released, const Wanted& wanted) {
  state_->ending = true;
  const Ending ending{state_->who, is_released, wanted};
  lock.unlock();
  std::string failure = on_end_(ending);
  lock.lock();
  state_.reset();
  keep();  // Follows the stop: if the servant is killed before, the next servant has to stop the arm.
  changed_.notify_all();
  return failure;
}

std::optional<Control::Holder> Control::holder() const {
  const std::lock_guard lock(mutex_);
  if (!state_) return std::nullopt;
  return Holder{state_->who, left_s()};
}

std::string Control::name_of(const std::string& key) const {
  const std::lock_guard lock(mutex_);
  return !key.empty() && has_key(key) ? state_->who : std::string();
}

double Control::left_s() const {
  if (state_->uses > 0) return std::chrono::duration<double>(state_->lease).count();
  return std::max(0.0, std::chrono::duration<double>(state_->until - Clock::now()).count());
}

std::string Control::describe() const {
  if (state_->beginning) return fmt::format("'{}' is just getting control of the arm", state_->who);
  if (state_->ending)
    return fmt::format("'{}' is giving control back, the arm is being stopped", state_->who);
  return fmt::format("'{}' has control of the arm, for another {:.1f} s unless renewed", state_->who,
                     left_s());
}

Control::Use Control::use(const std::string& key) {
  const std::lock_guard lock(mutex_);
  if (key.empty()) {
    if (state_) throw not_ready(describe());
    ++public_uses_;
    return {this, kPublic};
  }
  State& state = held_by(key);
  ++state.uses;
  keep();
  return {this, state.number};
}

std::optional<Control::Use> Control::try_use(const std::string& key) {
  const std::lock_guard lock(mutex_);
  if (key.empty() || !has_key(key)) return std::nullopt;
  ++state_->uses;
  keep();
  return Use(this, state_->number);
}

void Control::end_use(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  if (number == kPublic) {
    if (--public_uses_ == 0) changed_.notify_all();
    return;
  }
  // Control may have been released meanwhile, and acquired by another client.
  if (!state_ || state_->number != number) return;
  --state_->uses;
  state_->until = Clock::now() + state_->lease;
  keep();
  changed_.notify_all();
}

void Control::run() {
  ::pthread_setname_np(::pthread_self(), "robot.control");
  std::unique_lock lock(mutex_);
  while (!closing_) {
    if (!state_ || state_->ending || !state_->may_expire || state_->uses > 0) {
      changed_.wait(lock);
    } else if (has_run_out()) {
      (void)end(lock, false, {});  // on_end has reported a failure
    } else {
      const Clock::time_point until = state_->until;
      changed_.wait_until(lock, until);
    }
  }
}

}  // namespace corbot
