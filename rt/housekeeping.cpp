// SPDX-License-Identifier: Apache-2.0
#include "rt/housekeeping.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <thread>

#include "alarms/alarm_text.h"
#include "notify/service_notifier.h"

namespace corbot::rt {
namespace {

constexpr std::chrono::milliseconds kInterval{50};

template <class Log>
void print_alarms(Log& log, const JointKinds& kinds) {
  AlarmEvent alarm{};
  while (log.pop(alarm) == PopResult::kOk) {
    spdlog::log(causes_error(alarm.code) ? spdlog::level::err : spdlog::level::warn, "alarm {}: {}",
                static_cast<std::uint32_t>(alarm.code), alarm_text(alarm, kinds));
  }
}

spdlog::level::level_enum level_of(const LogLine& line) {
  return is_warning(line.kind) ? spdlog::level::warn : spdlog::level::info;
}

}  // namespace

void print_log(Backend& backend) {
  for (const LogLine& line : backend.drain_log()) {
    spdlog::log(level_of(line), "{}: {}{}", backend.name(), to_string(line),
                line.kind == LogLine::Kind::kLost ? "; trying again" : "");
  }
}

void print_log(SafetyLines& safety) {
  for (const LogLine& line : safety.drain_log()) spdlog::log(level_of(line), "{}", to_string(line));
}

void run_housekeeping(const ChannelServer& server, Cycle& cycle, Backend& backend, SafetyLines& safety,
                      const JointKinds& kinds, const std::atomic<bool>& ended) {
  RingConsumer alarms(cycle.alarm_log());
  bool had_servant = false;
  while (!ended.load(std::memory_order_acquire)) {
    print_alarms(alarms, kinds);
    print_log(backend);
    print_log(safety);
    const bool has_servant = server.servant_connected();
    if (has_servant && !had_servant) spdlog::info("servant connected");
    if (!has_servant && had_servant) {
      spdlog::warn(
          "the servant is gone; a motion under way stops on its path unless a servant responds in time");
    }
    had_servant = has_servant;
    std::this_thread::sleep_for(kInterval);
  }
  print_alarms(alarms, kinds);
}

void report_progress(const Cycle& cycle, const std::atomic<bool>& ended) {
  ServiceNotifier supervisor;
  std::uint64_t reported_cycle = 0;
  while (!ended.load(std::memory_order_acquire)) {
    if (Snapshot now{}; cycle.newest(now) && now.cycle != reported_cycle) {
      reported_cycle = now.cycle;
      supervisor.ready();
      supervisor.alive();
    }
    std::this_thread::sleep_for(kInterval);
  }
}

}  // namespace corbot::rt
