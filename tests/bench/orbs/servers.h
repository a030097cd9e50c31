// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sched.h>

#include <list>
#include <string>
#include <vector>

#include "support/process.h"

namespace corbot::bench {

/// A directory of this run, in the build tree, for sockets and whatever else programs leave in a temporary
/// directory; removed with this object.
class Scratch {
 public:
  Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch();
  /// A path for a Unix socket.
  [[nodiscard]] std::string socket(const std::string& name) const;

 private:
  std::string path_;
};

/// Places clients and servers on one CPU, and the real-time tasks on the others if there are any. The kernel
/// leaves two threads that talk on one CPU or on two for seconds, by chance. The latter took three times as
/// long, which would drown the difference.
class Placement {
 public:
  Placement();
  /// Pins this thread, and the threads and processes that it starts from now on, to these CPUs.
  void on_the_one() const;
  void on_the_others() const;

 private:
  cpu_set_t one_{};
  cpu_set_t others_{};
};

/// The server processes; they end in reverse order.
class Servers {
 public:
  Servers() = default;
  Servers(const Servers&) = delete;
  Servers& operator=(const Servers&) = delete;
  ~Servers();
  /// Starts `command`, waits until it is ready, and returns what follows that word in its ready line.
  std::string start(std::vector<std::string> command);
  /// The same for servant `program` of the robot `name`, with a real-time task of its own.
  /// `address`: options.
  std::string start_robot(const std::string& program, const std::string& name,
                          const std::vector<std::string>& address);

 private:
  Placement placement_;
  std::list<test::Process> running_;
};

}  // namespace corbot::bench
