// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "corbot/arm/arm_model.h"
#include "corbot/arm/joint_ranges.h"

namespace corbot {

/// What is wrong with saved soft limits. What they were is not known then, and nobody says that there were none.
class SoftLimitsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr std::size_t kMaxSoftLimitsBytes = 4096;

/// TOML, for a person to read, too. Degrees.
[[nodiscard]] std::string soft_limits_text(const JointRanges& limits, const std::string& robot,
                                           const std::string& device, const ArmModel& arm);
/// Reads what soft_limits_text() wrote. Trusts no byte: throws SoftLimitsError unless they are of this robot,
/// of this device (`kind` of [backend]) and of this model of its arm, finite, in order, and within the joints' ranges.
[[nodiscard]] JointRanges parse_soft_limits(std::string_view text, std::string_view robot,
                                            std::string_view device, const ArmModel& arm);

/// The file DIRECTORY/STEM.limits, see state_file_stem(), written by the servant alone. Not real-time safe.
class SoftLimitsStore {
 public:
  /// Throws std::invalid_argument for a name that no robot can have.
  SoftLimitsStore(const std::filesystem::path& directory, std::string robot, std::string device);

  /// Nothing when there is no such file. Throws SoftLimitsError for every file that is to be rejected, also one that other
  /// users may write to, or that cannot be read.
  [[nodiscard]] std::optional<JointRanges> load(const ArmModel& arm) const;
  /// Whole, or not at all; nothing: the file is removed. Throws std::system_error.
  void save(const std::optional<JointRanges>& limits, const ArmModel& arm) const;

 private:
  std::filesystem::path file_;
  std::filesystem::path fresh_;
  std::string robot_;
  std::string device_;
};

}  // namespace corbot
