// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "cli/supervise/descriptor_store.h"

namespace corbot::cli {

/// The supervisor of `corbot up` itself: systemd for a unit of Type=notify, or none. It receives the
/// notifications that the robot is ready and alive. It stores the descriptors of the processes, so that they
/// outlive this one.
class ServiceManager {
 public:
  /// Takes the descriptors that were stored for this process. Must precede the opening of any other file.
  ServiceManager();

  /// Returns, once, the descriptors stored for a process of this title.
  [[nodiscard]] std::vector<DescriptorStore::Item> take(const std::string& title);
  void store(const std::string& title, const std::string& name, int fd) const;
  void remove(const std::string& title, const std::string& name) const;

  void ready(const std::string& status) const;
  /// To be called several times a second while every process is ready and responds.
  void feed();
  void ending() const;

 private:
  std::vector<DescriptorStore::Item> kept_;  ///< named "TITLE/NAME"
  std::chrono::microseconds interval_{0};    ///< 0: no watchdog
  std::chrono::steady_clock::time_point fed_{};
};

}  // namespace corbot::cli
