// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace corbot {

/// The reason why the channel of a robot, or one of its segments, cannot be used. what() says what to do.
class SegmentError : public std::runtime_error {
 public:
  enum class Kind {
    kAbsent,            ///< no real-time task of that robot runs
    kForeign,           ///< not corbot's, for another robot, or another kind of segment
    kWrongVersion,      ///< of another ABI version
    kWrongFingerprint,  ///< of an arm with different geometry or limits
    kInUse,             ///< another live process has that role; its pid is in the text
    kPermission,        ///< created by another user, open to others, or not accessible
    kSystem,            ///< a system call failed
    kWrongSize,         ///< of this ABI version, but of another size: built with another layout
    kBadName,           ///< not [A-Za-z0-9_-]{1,48}
    kUnsealed,          ///< its size can change, or processes other than its creator can write it
    kSparse,            ///< not all of it has memory
    kSilent,            ///< the peer lives but does not answer
  };

  SegmentError(Kind kind, const std::string& text) : std::runtime_error(text), kind_(kind) {}
  [[nodiscard]] Kind kind() const noexcept { return kind_; }

 private:
  Kind kind_;
};

}  // namespace corbot
