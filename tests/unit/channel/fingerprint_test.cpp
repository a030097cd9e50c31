// SPDX-License-Identifier: Apache-2.0
#include "corbot/channel/fingerprint.h"

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <numbers>
#include <set>
#include <vector>

#include "corbot/kinematics/dh_table.h"

namespace corbot {
namespace {

/// A base and two links of this length.
JointChain arm(double link_m) {
  DhTable table;
  table.count = 3;
  table.rows[0].alpha_rad = std::numbers::pi / 2;
  table.rows[1].a_m = link_m;
  table.rows[2].a_m = link_m;
  return joint_chain(table);
}

TEST(Fingerprint, IsFnv1a) {
  // Reference value of the draft for the eight bytes "chongo w": computed byte by byte here,
  // independently of add().
  std::uint64_t expected = 14695981039346656037u;
  std::uint64_t word = 0;
  std::memcpy(&word, "chongo w", 8);
  for (const char c : {'c', 'h', 'o', 'n', 'g', 'o', ' ', 'w'}) {
    expected ^= static_cast<unsigned char>(c);
    expected *= 1099511628211u;
  }
  Fnv1a hash;
  hash.add(word);
  EXPECT_EQ(hash.value(), expected);
}

TEST(Fingerprint, ChangesWithEveryFieldThatBothSidesMustAgreeOn) {
  const std::vector<std::function<void(ArmModel&)>> changes = {
      [](ArmModel&) {},
      [](ArmModel& m) { m.kind = ArmKind::kScara; },
      [](ArmModel& m) { m.dof = 4; },
      [](ArmModel& m) { m.kinematics = Kinematics::recognise(arm(0.1)); },
      [](ArmModel& m) { m.kinematics = Kinematics::recognise(arm(0.2)); },
      [](ArmModel& m) { m.kinematics = Kinematics::other(arm(0.2)); },
      [](ArmModel& m) {
        m.kinematics.set_frames({{0.0, 0.0, 0.1}, {}}, {});
      },
      [](ArmModel& m) {
        m.kinematics.set_frames({}, {{0.0, 0.0, 0.1}, {}});
      },
      [](ArmModel& m) { m.joints[0].lower_q = 0.1; },
      [](ArmModel& m) { m.joints[0].upper_q = 0.1; },
      [](ArmModel& m) { m.joints[5].jerk_q_s3 = 0.1; },
      [](ArmModel& m) { m.orientation_error_rad = 0.1; },
      [](ArmModel& m) { m.path.speed_m_s = 0.1; },
      [](ArmModel& m) { m.path.rotation_jerk_rad_s3 = 0.1; },
      [](ArmModel& m) { m.gripper.travel_s = 0.1; },
      [](ArmModel& m) { m.period_ns = 2'000'000; },
  };
  std::set<std::uint64_t> seen;
  for (const auto& change : changes) {
    ArmModel model;
    change(model);
    seen.insert(fingerprint(model));
  }
  EXPECT_EQ(seen.size(), changes.size());
}

TEST(Fingerprint, IgnoresTheSignOfZeroAndTheServoMap) {
  ArmModel plain;
  ArmModel other;
  plain.kinematics.set_frames({}, {});
  other.kinematics.set_frames({{-0.0, 0.0, 0.0}, {}}, {});
  other.servos[2].zero_us = 1500;
  EXPECT_EQ(fingerprint(plain), fingerprint(other));
}

}  // namespace
}  // namespace corbot
