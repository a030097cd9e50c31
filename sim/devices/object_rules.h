// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "sim/devices/can_objects.h"

namespace corbot::sim {

/// An object, or all sub-indices of one.
struct ObjectPattern {
  std::uint16_t index{};
  std::optional<std::uint8_t> sub{};

  [[nodiscard]] bool fits(ObjectKey key) const { return key >> 8 == index && (!sub || *sub == (key & 0xFF)); }
  friend bool operator==(const ObjectPattern&, const ObjectPattern&) = default;
};

/// The condition under which a drive accepts a write to an object.
enum class WriteWhen {
  kAlways,
  kNever,
  kPreOperational,
  kPdosOff,       ///< no PDO is valid
  kModeInactive,  ///< 6061h is 0
  kDisabled,      ///< the drive is not in operation enabled
};

/// The deviations of this drive from CiA 301 and CiA 402. They stay when the drive is restarted.
class ObjectRules {
 public:
  void set_when(const ObjectPattern& where, WriteWhen when);
  void set_missing(const ObjectPattern& where, bool is_missing);
  void set_unanswered(const ObjectPattern& where, bool is_unanswered);
  void set_value(ObjectKey key, std::int64_t value) { values_[key] = value; }

  /// Applies them to a dictionary as from the factory, or to one that has them already.
  void apply_to(CanObjects& objects) const;
  [[nodiscard]] WriteWhen when(ObjectKey key) const;
  [[nodiscard]] bool is_unanswered(ObjectKey key) const;

 private:
  struct Timing {
    ObjectPattern where;
    WriteWhen when;
  };
  std::vector<Timing> timings_;  ///< the last that fits counts
  std::vector<ObjectPattern> missing_;
  std::vector<ObjectPattern> unanswered_;
  std::map<ObjectKey, std::int64_t> values_;
};

}  // namespace corbot::sim
