// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace corbot::bench {

/// A program that was started, is ready, and is spoken to in lines. It ends with this object, and with this
/// process however that ends.
class Child {
 public:
  /// Starts `command` and waits for its first line of output that begins with "ready". std::runtime_error
  /// when that does not come.
  explicit Child(std::vector<std::string> command);
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child();

  /// What follows "ready " in that line.
  [[nodiscard]] const std::string& ready() const { return ready_; }
  void write_line(const std::string& line);
  /// The next line of output, without its end. std::runtime_error when there is none within a minute.
  std::string read_line();

 private:
  bool read_more();
  void end();

  std::string program_;
  pid_t pid_ = -1;
  int input_ = -1;
  int output_ = -1;
  std::string unread_;
  std::string ready_;
};

}  // namespace corbot::bench
