// SPDX-License-Identifier: Apache-2.0
#include "rt/housekeeping.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>

#include "alarms/alarm_text.h"

namespace corbot::rt {
namespace {

constexpr std::chrono::milliseconds kInterval{50};

void print_alarms(Cycle& cycle) {
  RingConsumer log(cycle.alarm_log());
  AlarmEvent alarm{};
  while (log.pop(alarm) == PopResult::kOk) {
    spdlog::log(causes_error(alarm.code) ? spdlog::level::err : spdlog::level::warn, "alarm {}: {}",
                static_cast<std::uint32_t>(alarm.code), alarm_text(alarm));
  }
}

template <class Print>
void for_each_line(const std::string& news, Print&& print) {
  for (std::size_t begin = 0; begin < news.size();) {
    const std::size_t end = std::min(news.find('\n', begin), news.size());
    print(news.substr(begin, end - begin));
    begin = end + 1;
  }
}

}  // namespace

void print_news(Backend& backend) {
  for_each_line(backend.take_news(), [&](const std::string& line) {
    spdlog::log(line.starts_with("lost") ? spdlog::level::warn : spdlog::level::info, "{}: {}",
                backend.name(), line);
  });
}

void print_news(SafetyLines& safety) {
  for_each_line(safety.take_news(), [](const std::string& line) { spdlog::warn("{}", line); });
}

void keep_house(const Segment& segment, Cycle& cycle, Backend& backend, SafetyLines& safety,
                const std::atomic<bool>& ended) {
  bool had_servant = false;
  while (!ended.load(std::memory_order_acquire)) {
    print_alarms(cycle);
    print_news(backend);
    print_news(safety);
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
