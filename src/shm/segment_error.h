// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace corbot {

/// Why a shared-memory segment cannot be used. what() names the file and says what to do.
class SegmentError : public std::runtime_error {
 public:
  enum class Kind {
    kAbsent,            ///< there is none of that name (or its creator has not finished)
    kForeign,           ///< not written by corbot, or for another robot
    kTruncated,         ///< shorter than what its header promises
    kWrongVersion,      ///< of another ABI version
    kWrongFingerprint,  ///< of an arm with other geometry or limits
    kInUse,             ///< another live process has that role; its pid is in the text
    kPermission,        ///< not owned by the effective user, not mode 0600, or not accessible
    kSystem,            ///< a system call failed
    kWrongSize,         ///< of this ABI version, but another size: built with another layout
    kBadName,           ///< not [A-Za-z0-9_-]{1,48}
  };

  SegmentError(Kind kind, const std::string& text) : std::runtime_error(text), kind_(kind) {}
  [[nodiscard]] Kind kind() const noexcept { return kind_; }

 private:
  Kind kind_;
};

}  // namespace corbot
