// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "../../support/test_arms.h"

namespace corbot::test {

/// A rate line is a line at every limit of every joint.
enum class Kind { kJoint, kLine, kArc, kRateLine };

/// Motions of one kind of one arm; a shard has random numbers of its own.
struct Case {
  std::string arm;
  Kind kind;
  int shard;
};

inline std::string name_of(const Case& chosen) {
  constexpr std::array<const char*, 4> kNames{"Joint", "Line", "Arc", "RateLine"};
  return fmt::format("{}{}{}", chosen.arm, kNames[static_cast<std::size_t>(chosen.kind)], chosen.shard);
}
inline void PrintTo(const Case& chosen, std::ostream* out) { *out << name_of(chosen); }

inline int shards_of(const std::string& arm) { return arm == "lynx5" ? 4 : 1; }

/// Into how many cases the motions are divided: the Lynx 5 has a half of them, every other arm as many as the others.
inline std::uint64_t shares_of(const std::string& arm) {
  constexpr std::uint64_t kKinds = 4;
  return 2 * kKinds * (arm == "lynx5" ? 4 : kTestArms.size() - 1);
}

/// Every kind that the arm can plan. Lines and arcs with a law of an arm without a closed form are those of arms_paths_test.
inline std::vector<Case> motion_cases() {
  std::vector<Case> all;
  for (const std::string arm : kTestArms) {
    const ArmModel model = arm_of(arm);
    const bool has_form = model.kinematics.has_closed_form();
    for (const Kind kind : {Kind::kJoint, Kind::kLine, Kind::kArc, Kind::kRateLine}) {
      if (kind == Kind::kRateLine && !has_paths(model)) continue;
      if ((kind == Kind::kLine || kind == Kind::kArc) && !has_form) continue;
      for (int shard = 0; shard < shards_of(arm); ++shard) all.push_back({arm, kind, shard});
    }
  }
  return all;
}

}  // namespace corbot::test
