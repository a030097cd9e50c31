// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "cli/supervise/descriptor_store.h"

namespace corbot::cli {

/// What supervises `corbot up` itself: systemd where it runs as a unit of Type=notify, or nothing. It hears
/// that the robot is up and well, and keeps the descriptors of the processes, so that they outlive this one.
class ServiceManager {
 public:
  /// Takes the descriptors that were kept for this process. To be made before any other file is opened.
  ServiceManager();

  /// Those that were kept for a process of this title; once.
  [[nodiscard]] std::vector<DescriptorStore::Item> take(const std::string& title);
  void store(const std::string& title, const std::string& name, int fd) const;
  void remove(const std::string& title, const std::string& name) const;

  void ready(const std::string& status) const;
  /// To be called several times a second while every process is ready and responds.
  void feed();
  void ending() const;

 private:
  std::vector<DescriptorStore::Item> kept_;  ///< named "TITLE/NAME"
  std::chrono::microseconds interval_{0};    ///< 0: not watched
  std::chrono::steady_clock::time_point fed_{};
};

}  // namespace corbot::cli
