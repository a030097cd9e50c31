// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

namespace corbot {

/// Exclusive control of the arm: one holder at a time, for as long as a lease runs. The holder works through a reference
/// with a key that nobody can guess; whoever comes without it is refused what moves the arm or changes how it moves.
/// Thread-safe; not real-time safe.
class Control {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr double kShortestLease_s = 0.5;
  static constexpr double kLongestLease_s = 3600.0;
  static constexpr std::size_t kLongestName = 64;

  struct Holder {
    std::string who;
    double left_s{};  ///< of the lease; it does not run while a call of the holder is under way
  };

  /// `on_end`, which throws nothing, is called, without any lock of this class, by a thread of this class when a lease has run out, and by
  /// release(): the arm is to be stopped. No new holder is admitted before it has returned.
  explicit Control(std::function<void()> on_end);
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;
  ~Control();

  /// Takes control and returns the key, 32 hexadecimal digits of 128 random bits. Throws CallError: bad_argument for a
  /// lease or a name beyond the bounds above, not_ready when another has control.
  [[nodiscard]] std::string acquire(const std::string& who, double lease_s);
  /// The lease begins anew. Throws CallError (not ready) when this key has not, or no longer, control.
  void renew(const std::string& key);
  /// Gives control back. Throws as renew().
  void release(const std::string& key);

  [[nodiscard]] std::optional<Holder> holder() const;

  /// A call that moves the arm or changes how it moves, while it lasts. Its end begins the lease anew.
  class Use {
   public:
    Use(Use&& other) noexcept : control_(std::exchange(other.control_, nullptr)), number_(other.number_) {}
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    Use& operator=(Use&&) = delete;
    ~Use();

   private:
    friend class Control;
    Use(Control* control, std::uint64_t number) noexcept : control_(control), number_(number) {}
    Control* control_;
    std::uint64_t number_;
  };
  /// `key`: empty for the public reference. Throws CallError (not ready) when another has control, naming the holder and
  /// the time left, and when the key's control has ended.
  [[nodiscard]] Use use(const std::string& key);

 private:
  struct State {
    std::uint64_t number{};  ///< of this acquisition
    std::string who;
    std::string key;
    Clock::duration lease{};
    Clock::time_point until{};
    int uses{0};
    bool ending{false};  ///< on_end is under way
  };

  void run();
  void end_use(std::uint64_t number);
  void end(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] State& held_by(const std::string& key);
  [[nodiscard]] std::string describe() const;
  [[nodiscard]] double left_s() const;

  const std::function<void()> on_end_;
  mutable std::mutex mutex_;  // of the members below
  std::condition_variable changed_;
  std::optional<State> state_;
  std::uint64_t acquisitions_{0};
  bool closing_{false};
  std::thread thread_;
};

}  // namespace corbot
