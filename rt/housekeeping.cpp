// SPDX-License-Identifier: Apache-2.0
#include "rt/housekeeping.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>

#include "robot/alarm_words.h"

namespace corbot::rt {
namespace {

constexpr std::chrono::milliseconds kInterval{50};

void print_alarms(Cycle& cycle) {
  AlarmEvent alarm{};
  while (cycle.alarm_log().pop(alarm) == PopResult::kOk) {
    spdlog::log(causes_error(alarm.code) ? spdlog::level::err : spdlog::level::warn, "alarm {}: {}",
                static_cast<std::uint32_t>(alarm.code), alarm_text(alarm));
  }
}

}  // namespace

void print_news(Backend& backend) {
  const std::string news = backend.take_news();
  for (std::size_t begin = 0; begin < news.size();) {
    const std::size_t end = std::min(news.find('\n', begin), news.size());
    const std::string line = news.substr(begin, end - begin);
    spdlog::log(line.starts_with("lost") ? spdlog::level::warn : spdlog::level::info, "{}: {}",
                backend.name(), line);
    begin = end + 1;
  }
}

void keep_house(const Segment& segment, Cycle& cycle, Backend& backend, const std::atomic<bool>& ended) {
  bool had_servant = false;
  while (!ended.load(std::memory_order_acquire)) {
    print_alarms(cycle);
    print_news(backend);
    const bool has_servant = segment.peer_alive();
    if (has_servant && !had_servant) spdlog::info("servant is here");
    if (!has_servant && had_servant) {
      spdlog::warn("servant gone, finishing what was accepted, then holding");
    }
    had_servant = has_servant;
    std::this_thread::sleep_for(kInterval);
  }
  print_alarms(cycle);
}

}  // namespace corbot::rt
