// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "corbot/backend/backend.h"
#include "corbot/channel/records.h"

namespace corbot::rt {

/// Detects whether the gripper holds something, from the measured and the commanded opening. Real-time safe.
class GripWatch {
 public:
  enum class Grip { kUnknown, kNothing, kSomething };

  /// The fingers are at the commanded opening if they are nearer than this. As a share of the opening.
  static constexpr double kThere = 0.02;
  /// The fingers stand still if they stay within this band for kStill_ns.
  static constexpr double kBand = 0.005;
  static constexpr std::int64_t kStill_ns = 100'000'000;

  /// The time for which the last measurement counts: a device misses a reading now and then, and a slow bus
  /// has few.
  static constexpr std::int64_t kOld_ns = 500'000'000;

  /// Called once a cycle. `commanded`: set-point of the opening. `is_open`: the device gives energy and takes
  /// set-points. `ran_ns`: time that has passed, without gaps of this process. The time counts once a later
  /// record of the device has come.
  void see(double commanded, const ServoFeedback& feedback, bool is_open, std::int64_t ran_ns) noexcept {
    const bool is_new = feedback.measured && feedback.opening >= 0.0 && feedback.time_ns != said_ns_;
    has_moved_ |= commanded != commanded_;
    commanded_ = commanded;
    unseen_ns_ += ran_ns;
    if (!is_open || (!is_new && unseen_ns_ > kOld_ns)) is_measured_ = false;
    if (!is_open || !is_new) return;
    const bool stays = is_measured_ && std::abs(feedback.opening - still_at_) <= kBand && !has_moved_;
    is_measured_ = true;
    said_ns_ = feedback.time_ns;
    opening_ = feedback.opening;
    has_moved_ = false;
    still_ns_ = stays ? still_ns_ + unseen_ns_ : 0;
    if (!stays) still_at_ = opening_;
    unseen_ns_ = 0;
  }

  [[nodiscard]] bool is_measured() const noexcept { return is_measured_; }
  /// Returns kSomething if the fingers stand still short of the opening to which they were to close, kNothing
  /// if they are at that opening. It is unknown on the way, and if the fingers are kept from opening.
  [[nodiscard]] Grip grip() const noexcept {
    if (!is_measured_) return Grip::kUnknown;
    if (std::abs(opening_ - commanded_) <= kThere) return Grip::kNothing;
    return opening_ > commanded_ && still_ns_ >= kStill_ns ? Grip::kSomething : Grip::kUnknown;
  }
  /// Returns the grip as a bit of Snapshot::flags.
  [[nodiscard]] std::uint32_t snapshot_flag() const noexcept {
    if (grip() == Grip::kUnknown) return 0;
    return grip() == Grip::kSomething ? kSnapshotHolding : kSnapshotHoldsNothing;
  }
  /// Tells whether the fingers have gone as far as they can, closing or opening.
  [[nodiscard]] bool is_at_rest() const noexcept {
    return grip() != Grip::kUnknown || (is_measured_ && still_ns_ >= kStill_ns);
  }

 private:
  bool is_measured_{false};
  double commanded_{0.0};
  bool has_moved_{false};  ///< the set-point has moved since the last record
  double opening_{-1.0};
  double still_at_{-1.0};
  std::int64_t said_ns_{0};    ///< time of the last record
  std::int64_t unseen_ns_{0};  ///< time since the last record
  std::int64_t still_ns_{0};
};

}  // namespace corbot::rt
