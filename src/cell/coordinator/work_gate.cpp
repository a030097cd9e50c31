// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/work_gate.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <utility>

namespace corbot::cell {

WorkGate::WorkGate(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream stream(file_);
  for (std::string word; stream >> word;) (word == "stop" ? is_stopped_ : is_paused_) = true;
  keep();
}

void WorkGate::set(bool& flag, bool value) {
  const std::lock_guard lock(mutex_);
  flag = value;
  changed_.notify_all();
}

/// Overwrites the file by one write of constant size.
void WorkGate::keep() const {
  if (file_.empty()) return;
  const std::lock_guard lock(file_mutex_);
  const std::string text =
      fmt::format("{:<5} {:<4}\n", is_paused() ? "pause" : "", is_stopped() ? "stop" : "");
  const int file = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0 || ::pwrite(file, text.data(), text.size(), 0) < 0)
    spdlog::error("{}: {}: the next coordinator does not know of a pause or a stop", file_.string(),
                  std::strerror(errno));
  if (file >= 0) ::close(file);
}

}  // namespace corbot::cell
