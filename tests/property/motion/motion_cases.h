// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "../../support/test_arms.h"

namespace corbot::test {

enum class Kind { kJoint, kLine, kArc };

/// Motions of one kind of one arm; a shard has random numbers of its own.
struct Case {
  std::string arm;
  Kind kind;
  int shard;
};

inline std::string name_of(const Case& chosen) {
  constexpr std::array<const char*, 3> kNames{"Joint", "Line", "Arc"};
  return fmt::format("{}{}{}", chosen.arm, kNames[static_cast<std::size_t>(chosen.kind)], chosen.shard);
}
inline void PrintTo(const Case& chosen, std::ostream* out) { *out << name_of(chosen); }

inline int shards_of(const std::string& arm) { return arm == "lynx5" ? 4 : 1; }

/// Every kind that the arm can plan. It loads no profile: each start of the program makes this list.
inline std::vector<Case> motion_cases() {
  std::vector<Case> all;
  for (const std::string arm : kTestArms) {
    const bool has_paths = arm != "turntable";
    for (const Kind kind : {Kind::kJoint, Kind::kLine, Kind::kArc}) {
      if (kind != Kind::kJoint && !has_paths) continue;
      for (int shard = 0; shard < shards_of(arm); ++shard) all.push_back({arm, kind, shard});
    }
  }
  return all;
}

/// Into how many cases the motions are divided: the Lynx 5 has a half of them, all other cases have as many
/// as one another.
inline std::int64_t shares_of(const std::string& arm) {
  const auto is_lynx5 = [](const std::string& name) { return name == "lynx5"; };
  const std::vector<Case> all = motion_cases();
  return 2 * std::count_if(all.begin(), all.end(),
                           [&](const Case& each) { return is_lynx5(each.arm) == is_lynx5(arm); });
}

}  // namespace corbot::test
