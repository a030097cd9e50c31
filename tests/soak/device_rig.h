// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "soak/device_log.h"
#include "support/process.h"

namespace corbot::soak {

enum class DeviceKind { kSsc32, kMaestro, kCia402 };
[[nodiscard]] const char* to_string(DeviceKind kind);

/// An emulated device of corbot-sim, and the profile of an arm that has it.
class DeviceRig {
 public:
  /// `profile`: everything before its [backend] is taken over.
  DeviceRig(DeviceKind kind, std::string program, std::string scratch, const std::string& profile);

  [[nodiscard]] DeviceKind kind() const noexcept { return kind_; }
  [[nodiscard]] const std::string& profile() const noexcept { return profile_; }
  /// Throws std::runtime_error when it does not come up.
  void start();
  void kill();
  void freeze(bool is_frozen);
  /// One line of its standard input, see corbot-sim --help; not waited for.
  void command(const std::string& line);
  /// Asks from time to time how late the emulator was: what it did not answer in time is no fault of the
  /// robot's.
  void look();
  [[nodiscard]] const std::vector<Interval>& late() const noexcept { return late_; }
  /// Ends it, in order; its exit code.
  int stop();
  /// All that its records say so far.
  [[nodiscard]] DeviceLog log(const ArmModel& arm) const;

 private:
  struct Life {
    std::int64_t begin_ns;
    std::int64_t end_ns;  ///< 0: it lives
    std::string record;
  };
  [[nodiscard]] std::string backend() const;
  [[nodiscard]] std::vector<std::string> words() const;

  const DeviceKind kind_;
  const std::string program_;
  const std::string scratch_;
  const std::string profile_;
  std::unique_ptr<test::Process> process_;
  std::vector<Life> lives_;
  std::vector<Interval> late_;
  std::size_t read_{0};  ///< of what this process has printed
  std::int64_t looked_ns_{0};
};

}  // namespace corbot::soak
