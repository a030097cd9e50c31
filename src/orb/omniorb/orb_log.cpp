// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/orb_log.h"

#include <fmt/format.h>
#include <omniORB4/CORBA.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <string>

namespace corbot::omni {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostLines = 100;
constexpr auto kPeriod = std::chrono::minutes(1);

struct Log {
  std::mutex mutex;
  Clock::time_point began{};
  int written{0};
  std::uint64_t left_out{0};

  void write(const char* line) {
    const std::lock_guard lock(mutex);
    if (const auto now = Clock::now(); now - began > kPeriod) {
      began = now;
      written = 0;
    }
    if (written == kMostLines) {
      ++left_out;
      return;
    }
    ++written;
    std::string text(line);
    if (left_out > 0) text += fmt::format("omniORB: {} lines before this one were left out\n", left_out);
    left_out = 0;
    (void)std::fputs(text.c_str(), stderr);
  }
};

Log log_of_orb;

}  // namespace

void limit_orb_log() {
  omniORB::setLogFunction([](const char* line) { log_of_orb.write(line); });
}

}  // namespace corbot::omni
