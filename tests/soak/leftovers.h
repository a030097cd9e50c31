// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <string>

namespace corbot::soak {

/// The resources that a process holds.
struct Holdings {
  int descriptors{};
  int threads{};
};
/// Nothing where there is no such process.
[[nodiscard]] Holdings holdings_of(pid_t pid);

/// Compares the processes of a robot at rest with those of the first time, whichever incarnation: none may
/// come to hold more by what was broken around it.
class RestCheck {
 public:
  /// Waits until none holds more than at the first call, and says which does; "" when none. `processes`: by
  /// name, as they are now: it is called again and again.
  [[nodiscard]] std::string look(const std::function<std::map<std::string, pid_t>()>& processes);
  /// The most that any of these names held beyond the first time, once it had been waited for.
  [[nodiscard]] std::string summary() const;

 private:
  std::map<std::string, Holdings> first_;
  std::map<std::string, Holdings> most_;
  int looks_{0};
};

/// After the end of a robot with all its processes: processes that were started for it, sockets, shared
/// memory, and files that bear its name outside `scratch`. One a line.
[[nodiscard]] std::string leftovers(const std::string& robot, const std::string& scratch, int port);

}  // namespace corbot::soak
