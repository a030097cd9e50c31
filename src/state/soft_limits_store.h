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

/// A fault of saved soft limits. Their values are then unknown; the fault does not mean that there were none.
class SoftLimitsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr std::size_t kMaxSoftLimitsBytes = 4096;

/// Returns the limits as TOML in degrees, which a person can read, too.
[[nodiscard]] std::string soft_limits_text(const JointRanges& limits, const std::string& robot,
                                           const std::string& device, const ArmModel& arm);
/// Reads the output of soft_limits_text() without trusting any byte. Throws SoftLimitsError unless the limits
/// are of this robot, this device (`kind` of [backend]) and this model of its arm. They must also be finite,
/// in order, and within the joints' ranges.
[[nodiscard]] JointRanges parse_soft_limits(std::string_view text, std::string_view robot,
                                            std::string_view device, const ArmModel& arm);

/// The file DIRECTORY/STEM.limits, see state_file_stem(), which only the servant writes. Not real-time safe.
class SoftLimitsStore {
 public:
  /// Throws std::invalid_argument for a name that no robot can have.
  SoftLimitsStore(const std::filesystem::path& directory, std::string robot, std::string device);

  /// Returns nothing if there is no such file. Throws SoftLimitsError for every invalid file, including one
  /// that other users may write to, or that is unreadable.
  [[nodiscard]] std::optional<JointRanges> load(const ArmModel& arm) const;
  /// Saves the limits completely or not at all; without limits removes the file. Throws std::system_error.
  void save(const std::optional<JointRanges>& limits, const ArmModel& arm) const;

 private:
  std::filesystem::path file_;
  std::filesystem::path fresh_;
  std::string robot_;
  std::string device_;
};

}  // namespace corbot
