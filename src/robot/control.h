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

#include "corbot/channel/control_bounds.h"
#include "corbot/channel/servant_state.h"
#include "robot/wanted.h"

namespace corbot {

/// Exclusive control of the arm, for one holder at a time and for the duration of a lease. The holder uses a
/// reference with a key that cannot be guessed. A caller without the key may not move the arm or change how
/// it moves. Control outlives the process: a record for the next servant stores a digest of the key, never
/// the key. Thread-safe; not real-time safe.
class Control {
 public:
  using Clock = std::chrono::steady_clock;  // CLOCK_MONOTONIC, which a later process reads, too

  /// Longest wait for other clients' calls that were admitted before an Acquire. Exceeds the longest Cancel.
  static constexpr std::chrono::seconds kCallsEnd{15};

  struct Holder {
    std::string who;
    double left_s{};  ///< time left of the lease; it does not run during a call of the holder
  };

  /// Control has ended, and the arm must stop.
  struct Ending {
    std::string who;
    bool is_released{};  ///< the holder or a forced release ended control; false: the lease has run out
    Wanted wanted{};     ///< abort check of the wait for the stop
  };
  /// Stops the arm. Throws nothing; returns the reason if the arm may not have stopped, "" if it has. This
  /// class calls it without any of its locks: from release(), and from its own thread when a lease has run
  /// out. No new holder is admitted before it has returned.
  using OnEnd = std::function<std::string(const Ending&)>;
  /// Throws CallError if no client may take control now. This class calls it without any of its locks.
  using Admit = std::function<void()>;

  /// `kept` is the record for the next servant and outlives this.
  Control(DurableCell<ControlRecord>& kept, OnEnd on_end);
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;
  ~Control() { close(); }
  /// Ends the thread. The holder keeps control: the next servant inherits it.
  void close();

  /// Returns true if acquire() could have stored this record. Another process wrote it, so it can contain
  /// anything.
  [[nodiscard]] static bool is_valid(const ControlRecord& record);
  /// Takes over a valid record of the previous servant. The lease continues; it begins anew if a call of the
  /// holder was under way. It does not end before allow_expiry(). No effect if a client already has control
  /// here.
  void inherit(const ControlRecord& record);
  /// Lets leases expire from now on: a real-time task is connected, so the arm can be stopped.
  void allow_expiry();

  /// Takes control and returns the key, 32 hexadecimal digits of 128 random bits. Throws CallError:
  /// bad_argument for a lease or a name beyond control_bounds.h, not_ready if another client has control, and
  /// whatever `admit` throws. A throwing `admit` leaves no control behind. The first call of `admit` precedes
  /// the refusal of all others, so that a hopeless attempt disturbs no client. The second follows when all
  /// calls that were admitted before have returned. `wanted` is the abort check of that wait, called without
  /// any lock of this class.
  [[nodiscard]] std::string acquire(const std::string& who, double lease_s, const Admit& admit,
                                    const Wanted& wanted = {});
  /// Begins the lease anew. Throws CallError (not ready) if this key does not have control, or no longer.
  void renew(const std::string& key);
  /// Ends control. Throws like renew(). Throws not_ready with the result of on_end if that is not empty;
  /// control has ended then, too.
  void release(const std::string& key, const Wanted& wanted = {});

  /// Ends control of any holder, for the robot's user when the key is lost. Throws CallError (not ready) if
  /// no client has control or an acquire() is under way, and throws like release().
  void end_by_force();

  [[nodiscard]] std::optional<Holder> holder() const;
  /// Returns the name under which this key has control, or "" if it does not.
  [[nodiscard]] std::string name_of(const std::string& key) const;

  /// A call that moves the arm or changes how it moves, for its duration. Its end begins the lease anew.
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
  /// Admits a call. `key`: "" for the public reference. Throws CallError (not ready) if another client has
  /// control, with the holder and the time left, and if the key's control has ended.
  [[nodiscard]] Use use(const std::string& key);
  /// Admits a call that every client may make. A call of the holder keeps the lease from expiring.
  [[nodiscard]] std::optional<Use> try_use(const std::string& key);

 private:
  using Digest = decltype(ControlRecord::key_digest);
  struct State {
    std::uint64_t number{};  ///< number of this acquisition
    std::string who;
    Digest key_digest{};
    Clock::duration lease{};
    Clock::time_point until{};
    int uses{0};
    bool beginning{false};  ///< acquire() has not returned
    bool ending{false};     ///< on_end is under way
    bool may_expire{true};  ///< false: no real-time task is connected that could stop the arm
  };
  static constexpr std::uint64_t kPublic = 0;  ///< stands for no acquisition

  void run();
  void end_use(std::uint64_t number);
  void give_up(std::unique_lock<std::mutex>& lock, const Wanted& wanted);
  [[nodiscard]] std::string end(std::unique_lock<std::mutex>& lock, bool is_released, const Wanted& wanted);
  void await_alone(std::unique_lock<std::mutex>& lock, const Wanted& wanted);
  void keep();  ///< the caller holds the lock
  [[nodiscard]] bool has_run_out() const;
  [[nodiscard]] bool has_key(const std::string& key) const;
  [[nodiscard]] State& held_by(const std::string& key);
  [[nodiscard]] std::string describe() const;
  [[nodiscard]] double left_s() const;

  const OnEnd on_end_;
  mutable std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::optional<State> state_;
  DurableCell<ControlRecord>& kept_;
  std::uint64_t acquisitions_{kPublic};
  int public_uses_{0};
  bool closing_{false};
  std::thread thread_;
};

}  // namespace corbot
