// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "corbot/arm/joint_units.h"
#include "corbot/backend/backend.h"
#include "corbot/channel/alarms.h"

namespace corbot::rt {

/// The allowed distance of a joint from its set-point, if the device measures.
struct FollowingLimit {
  /// A greater error for longer than time_ns is a fault.
  double error_q{std::numeric_limits<double>::infinity()};
  std::int64_t time_ns{0};
  /// A motion is done when the joint is this near to its end.
  double goal_q{std::numeric_limits<double>::infinity()};
};

/// Compares set-points with measured positions. Real-time safe.
class FollowingCheck {
 public:
  using Limits = std::array<FollowingLimit, kMaxJoints>;
  explicit FollowingCheck(const Limits& limits) noexcept : limits_(limits) {}

  /// Reports that there is nothing to follow in this cycle.
  void rest() noexcept { beyond_ns_ = {}; }
  /// Called once a cycle; `ran_ns`: time that has passed, without gaps of this process. Returns the first
  /// joint that has been too far away for too long.
  [[nodiscard]] std::optional<alarm::JointDeviation> see(const Joints& set_point_q,
                                                         const ServoFeedback& feedback,
                                                         std::int64_t ran_ns) noexcept {
    // One lost answer must not hide a joint that stays too far away: its time stands meanwhile.
    if (!feedback.measured) return std::nullopt;
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      const double error_q = set_point_q[i] - feedback.position_q[i];
      // A value that is not a number is beyond every limit.
      beyond_ns_[i] = std::abs(error_q) <= limits_[i].error_q ? 0 : beyond_ns_[i] + ran_ns;
      if (beyond_ns_[i] > limits_[i].time_ns)
        return alarm::JointDeviation{static_cast<std::int32_t>(i), error_q, limits_[i].error_q};
    }
    return std::nullopt;
  }
  /// Returns the first joint that is not at its goal yet.
  [[nodiscard]] std::optional<alarm::JointDeviation> off_goal(const Joints& goal_q,
                                                              const ServoFeedback& feedback) const noexcept {
    for (std::size_t i = 0; feedback.measured && i < kMaxJoints; ++i) {
      const double error_q = goal_q[i] - feedback.position_q[i];
      if (!(std::abs(error_q) <= limits_[i].goal_q))
        return alarm::JointDeviation{static_cast<std::int32_t>(i), error_q, limits_[i].goal_q};
    }
    return std::nullopt;
  }

 private:
  Limits limits_;
  std::array<std::int64_t, kMaxJoints> beyond_ns_{};
};

/// Detects that the measured joints have come to rest: they have kept their positions for a while. Real-time
/// safe.
class RestCheck {
 public:
  /// The band of rest; near_q() of it for a sliding joint.
  static constexpr double kBand_rad = 0.002;
  static constexpr std::int64_t kWhile_ns = 50'000'000;

  explicit RestCheck(const JointKinds& kinds = {}) noexcept : kinds_(kinds) {}

  /// Called once a cycle; `ran_ns`: time that has passed, without gaps of this process. The time counts once
  /// a later record of the device has come: a record that is not renewed proves nothing.
  void see(const ServoFeedback& feedback, std::int64_t ran_ns) noexcept {
    unseen_ns_ += ran_ns;
    if (feedback.measured && feedback.time_ns == said_ns_) return;
    rested_ns_ += unseen_ns_;
    unseen_ns_ = 0;
    said_ns_ = feedback.time_ns;
    bool stays = feedback.measured;
    // A value that is not a number does not stay.
    for (std::size_t i = 0; stays && i < kMaxJoints; ++i)
      stays = std::abs(feedback.position_q[i] - there_q_[i]) <= near_q(kinds_[i], kBand_rad);
    if (stays) return;
    there_q_ = feedback.position_q;
    rested_ns_ = 0;
  }
  [[nodiscard]] bool is_at_rest() const noexcept { return rested_ns_ >= kWhile_ns; }

 private:
  JointKinds kinds_;
  Joints there_q_{};
  std::int64_t said_ns_{0};    ///< time of the last record
  std::int64_t unseen_ns_{0};  ///< time since the last record
  std::int64_t rested_ns_{0};
};

/// Awaits the device after the set-points of a motion have reached its end. The device must have taken the
/// last set-point and, if it measures, the joints must be there. Real-time safe.
class Settling {
 public:
  void begin(std::uint64_t cycle) noexcept {
    is_active_ = true;
    since_cycle_ = cycle;
    waited_ns_ = 0;
  }
  void end() noexcept { is_active_ = false; }
  [[nodiscard]] bool is_active() const noexcept { return is_active_; }
  /// Tells whether the device has taken the last set-point.
  [[nodiscard]] bool is_taken(const BackendTimes& times) const noexcept {
    return times.cycle >= since_cycle_;
  }
  /// Adds time that has passed, without gaps of this process. True if the wait was too long.
  [[nodiscard]] bool wait(std::int64_t ran_ns, std::int64_t longest_ns) noexcept {
    waited_ns_ += ran_ns;
    return waited_ns_ > longest_ns;
  }

 private:
  bool is_active_{false};
  std::uint64_t since_cycle_{0};
  std::int64_t waited_ns_{0};
};

}  // namespace corbot::rt
