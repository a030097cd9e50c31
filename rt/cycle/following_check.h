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

/// How near a joint must be to its set-point, where the device measures.
struct FollowingLimit {
  double error_q{
      std::numeric_limits<double>::infinity()};  ///< a fault when it is exceeded for longer than time_ns
  std::int64_t time_ns{0};
  double goal_q{
      std::numeric_limits<double>::infinity()};  ///< a motion is done when the joint is so near to its end
};

/// Compares set-points with what is measured. Real-time safe.
class FollowingCheck {
 public:
  using Limits = std::array<FollowingLimit, kMaxJoints>;
  explicit FollowingCheck(const Limits& limits) noexcept : limits_(limits) {}

  /// Nothing is to be followed in this cycle.
  void rest() noexcept { beyond_ns_ = {}; }
  /// Once a cycle; `ran_ns`: time that has passed, without gaps of this process's own. The first joint that has been too
  /// far away for too long.
  [[nodiscard]] std::optional<alarm::JointDeviation> see(const Joints& set_point_q,
                                                         const ServoFeedback& feedback,
                                                         std::int64_t ran_ns) noexcept {
    if (!feedback.measured) {
      rest();
      return std::nullopt;
    }
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      const double error_q = set_point_q[i] - feedback.position_q[i];
      // What is not a number is beyond every limit.
      beyond_ns_[i] = std::abs(error_q) <= limits_[i].error_q ? 0 : beyond_ns_[i] + ran_ns;
      if (beyond_ns_[i] > limits_[i].time_ns)
        return alarm::JointDeviation{static_cast<std::int32_t>(i), error_q, limits_[i].error_q};
    }
    return std::nullopt;
  }
  /// The first joint that is not at its goal yet.
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

/// Whether the measured joints have come to rest: they have stayed where they are for a while. Real-time safe.
class RestCheck {
 public:
  /// near_q() of it, where a joint slides.
  static constexpr double kBand_rad = 0.002;
  static constexpr std::int64_t kWhile_ns = 50'000'000;

  explicit RestCheck(const JointKinds& kinds = {}) noexcept : kinds_(kinds) {}

  /// Once a cycle; `ran_ns`: time that has passed, without gaps of this process's own. It counts once the device has
  /// said where the joints are after it: a record that is not renewed says nothing.
  void see(const ServoFeedback& feedback, std::int64_t ran_ns) noexcept {
    unseen_ns_ += ran_ns;
    if (feedback.measured && feedback.time_ns == said_ns_) return;
    rested_ns_ += unseen_ns_;
    unseen_ns_ = 0;
    said_ns_ = feedback.time_ns;
    bool stays = feedback.measured;
    for (std::size_t i = 0; stays && i < kMaxJoints; ++i)
      stays = std::abs(feedback.position_q[i] - there_q_[i]) <=
              near_q(kinds_[i], kBand_rad);  // what is not a number does not
    if (stays) return;
    there_q_ = feedback.position_q;
    rested_ns_ = 0;
  }
  [[nodiscard]] bool is_at_rest() const noexcept { return rested_ns_ >= kWhile_ns; }

 private:
  JointKinds kinds_;
  Joints there_q_{};
  std::int64_t said_ns_{0};    ///< when the last record was
  std::int64_t unseen_ns_{0};  ///< since the last record
  std::int64_t rested_ns_{0};
};

/// The set-points of a motion are at its end, and the device is awaited: that it has taken the last of them, and where
/// it measures, that the joints are there. Real-time safe.
class Settling {
 public:
  void begin(std::uint64_t cycle) noexcept {
    is_active_ = true;
    since_cycle_ = cycle;
    waited_ns_ = 0;
  }
  void end() noexcept { is_active_ = false; }
  [[nodiscard]] bool is_active() const noexcept { return is_active_; }
  /// Whether the device has taken the last set-point.
  [[nodiscard]] bool is_taken(const BackendTimes& times) const noexcept {
    return times.cycle >= since_cycle_;
  }
  /// Time that has passed, without gaps of this process's own. True when it was too long.
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
