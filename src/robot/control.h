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

/// Exclusive control of the arm: one holder at a time, for as long as a lease runs. The holder works through a reference
/// with a key that nobody can guess; whoever comes without it is refused what moves the arm or changes how it moves.
/// It outlives the process: a record for the next servant has all but the key, of which it has a digest.
/// Thread-safe; not real-time safe.
class Control {
 public:
  using Clock = std::chrono::steady_clock;  // CLOCK_MONOTONIC, which a later process reads, too

  /// For calls of others that were admitted before an Acquire: as long as a Cancel may take, and more.
  static constexpr std::chrono::seconds kCallsEnd{15};

  struct Holder {
    std::string who;
    double left_s{};  ///< of the lease; it does not run while a call of the holder is under way
  };

  /// Control has ended, and the arm is to be stopped.
  struct Ending {
    std::string who;
    bool is_released{};  ///< by its holder, or by force; else the lease has run out
    Wanted wanted{};     ///< how long its stop is waited for
  };
  /// Throws nothing; returns why it is not known that the arm has stopped, "": it has. Called without any lock of this
  /// class, by a thread of this class when a lease has run out, and by release(). No new holder is admitted before it has
  /// returned.
  using OnEnd = std::function<std::string(const Ending&)>;
  /// Throws CallError where nobody may take control now. Called without any lock of this class.
  using Admit = std::function<void()>;

  /// `kept`, for the next servant, outlives this.
  Control(DurableCell<ControlRecord>& kept, OnEnd on_end);
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;
  ~Control() { close(); }
  /// Ends the thread. Whoever has control keeps it: the next servant goes on with it.
  void close();

  /// Whether acquire() could have left such a record; what another process wrote can be anything.
  [[nodiscard]] static bool is_valid(const ControlRecord& record);
  /// Of the servant before, valid: its lease goes on; where a call of the holder was under way, it begins anew. It does
  /// not end before allow_expiry(). No effect when somebody has control of this one.
  void inherit(const ControlRecord& record);
  /// What ends from now on can be stopped: a real-time task is connected.
  void allow_expiry();

  /// Takes control and returns the key, 32 hexadecimal digits of 128 random bits. Throws CallError: bad_argument for a
  /// lease or a name beyond control_bounds.h, not_ready when another has control; and what `admit` throws, which leaves
  /// no control behind. `admit` is called before all others are refused, so that a hopeless attempt disturbs nobody, and
  /// again when whoever was admitted before has returned. `wanted`, without any lock of this class: while those are
  /// waited for.
  [[nodiscard]] std::string acquire(const std::string& who, double lease_s, const Admit& admit,
                                    const Wanted& wanted = {});
  /// The lease begins anew. Throws CallError (not ready) when this key has not, or no longer, control.
  void renew(const std::string& key);
  /// Gives control back. Throws as renew(); and not_ready, control having ended, with what on_end returned.
  void release(const std::string& key, const Wanted& wanted = {});

  /// The same for whoever has it: for the robot's user, where the key is lost. Throws CallError (not ready) where nobody
  /// has control, or just gets it; and as release().
  void end_by_force();

  [[nodiscard]] std::optional<Holder> holder() const;
  /// The name under which this key has control; empty: it has none.
  [[nodiscard]] std::string name_of(const std::string& key) const;

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
  /// A call that everyone may make; where it is the holder's, it keeps the lease from running out all the same.
  [[nodiscard]] std::optional<Use> try_use(const std::string& key);

 private:
  using Digest = decltype(ControlRecord::key_digest);
  struct State {
    std::uint64_t number{};  ///< of this acquisition
    std::string who;
    Digest key_digest{};
    Clock::duration lease{};
    Clock::time_point until{};
    int uses{0};
    bool beginning{false};  ///< acquire() has not returned
    bool ending{false};     ///< on_end is under way
    bool may_expire{true};  ///< false: no real-time task is connected that could stop the arm
  };
  static constexpr std::uint64_t kPublic = 0;  ///< number of no acquisition

  void run();
  void end_use(std::uint64_t number);
  void give_up(std::unique_lock<std::mutex>& lock, const Wanted& wanted);
  [[nodiscard]] std::string end(std::unique_lock<std::mutex>& lock, bool is_released, const Wanted& wanted);
  void await_alone(std::unique_lock<std::mutex>& lock, const Wanted& wanted);
  void keep();  ///< with the lock
  [[nodiscard]] bool has_run_out() const;
  [[nodiscard]] bool has_key(const std::string& key) const;
  [[nodiscard]] State& held_by(const std::string& key);
  [[nodiscard]] std::string describe() const;
  [[nodiscard]] double left_s() const;

  const OnEnd on_end_;
  mutable std::mutex mutex_;  // of the members below
  std::condition_variable changed_;
  std::optional<State> state_;
  DurableCell<ControlRecord>& kept_;
  std::uint64_t acquisitions_{kPublic};
  int public_uses_{0};
  bool closing_{false};
  std::thread thread_;
};

}  // namespace corbot
