// SPDX-License-Identifier: Apache-2.0
// Measures a Stop on both ORBs, from its last byte until the segment that the real-time task reads counts it.
// Usage: bench_stops [STOPS]. The Stop comes alone, and beside 100 connections that call all the time and a
// flood of new connections. The programs that make that load run below normal priority: elsewhere they have
// machines of their own.
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/core.h>

#include "shm/channel_client.h"
#include "support/giop.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/process.h"

namespace {

using namespace corbot;
using test::giop_request;
using test::RawConnection;
using test::within;
using Clock = std::chrono::steady_clock;

constexpr double kPatience_s = 30.0;  // generous: it only ends a hang

double since_us(Clock::time_point begin) {
  return std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
}

/// This runs a task and a servant of its own.
class Robot {
 public:
  explicit Robot(const std::string& servant)
      : rt_({std::string(CORBOT_BIN_DIR) + "/corbot-rt", CORBOT_TIMED_PROFILE, "--name", name_}),
        servant_(started(rt_, {std::string(CORBOT_BIN_DIR) + "/" + servant, CORBOT_TIMED_PROFILE, "--name",
                               name_, "--endpoint", fmt::format("127.0.0.1:{}", port_)})) {
    if (!servant_.wait_line("ready", within(kPatience_s))) throw std::runtime_error(servant_.errors());
    channel_ = std::make_unique<Observer>(Observer::of(name_));
  }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] std::uint64_t stops() const { return channel_->servant()->control.stop_count; }

 private:
  static std::vector<std::string> started(test::Process& rt, std::vector<std::string> command) {
    if (!rt.wait_line("ready", within(kPatience_s))) throw std::runtime_error(rt.errors());
    return command;
  }

  const std::string name_ = test::unique_name("stops");
  const int port_ = test::free_port();
  test::Process rt_;
  test::Process servant_;
  std::unique_ptr<Observer> channel_;
};

/// 100 connections have a call each, and new connections come one after another, of which 200 stay open.
class Load {
 public:
  explicit Load(const Robot& robot) : robot_(robot) {
    for (int i = 0; i < kBusyThreads; ++i) threads_.emplace_back([this] { ask(); });
    threads_.emplace_back([this] { connect(); });
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;
  ~Load() {
    ends_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  [[nodiscard]] std::string rates() const {
    const double s = 1e-6 * since_us(begin_);
    return fmt::format("{:.0f} answers, {:.0f} new connections a second", static_cast<double>(answers_) / s,
                       static_cast<double>(connections_) / s);
  }

 private:
  static constexpr int kBusyThreads = 4;
  static constexpr int kBusy = 100;
  static constexpr std::size_t kOpen = 200;

  static void go_below_normal_priority() {
    (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), 10);
  }
  void ask() {
    go_below_normal_priority();
    const std::string request = giop_request(1, robot_.name(), "_get_CartCoord");
    std::deque<RawConnection> busy;
    for (int i = 0; i < kBusy / kBusyThreads; ++i) busy.emplace_back(robot_.port());
    while (!ends_) {
      for (std::size_t i = busy.size(); i > 0; --i) {  // one that was closed comes again, at the end
        RawConnection connection = std::move(busy.front());
        busy.pop_front();
        if (connection.send(request)) {
          busy.push_back(std::move(connection));
        } else {
          busy.emplace_back(robot_.port());
        }
      }
      for (RawConnection& connection : busy)
        answers_ += connection.connected() && connection.reply(within(1.0)) ? 1 : 0;
    }
  }
  void connect() {
    go_below_normal_priority();
    const std::string request = giop_request(1, robot_.name(), "_get_DoF");
    std::deque<RawConnection> open;
    while (!ends_) {
      open.emplace_back(robot_.port());
      (void)open.back().send(request);
      ++connections_;
      if (open.size() > kOpen) open.pop_front();
    }
  }

  const Robot& robot_;
  const Clock::time_point begin_ = Clock::now();
  std::atomic<bool> ends_{false};
  std::atomic<long> answers_{0};
  std::atomic<long> connections_{0};
  std::vector<std::thread> threads_;
};

struct Result {
  std::vector<double> us;  ///< sorted
  int lost{};  ///< these were sent on a connection that was being closed; a client's ORB sends them again
};

/// This sends one Stop after another, on a connection that was used just before, and looks at the count every
/// 20 us.
Result measure(const Robot& robot, int stops) {
  const std::string read = giop_request(1, robot.name(), "_get_DoF");
  const std::string stop = giop_request(2, robot.name(), "Stop");
  constexpr timespec kLook{0, 20'000};
  Result result;
  std::optional<RawConnection> client;
  while (result.us.size() < static_cast<std::size_t>(stops)) {
    if (!client) client.emplace(robot.port());
    if (!client->connected() || !client->send(read) || !client->reply(within(kPatience_s))) {
      client.reset();
      continue;
    }
    const std::uint64_t before = robot.stops();
    const auto begin = Clock::now();
    bool is_counted = false;
    if (client->send(stop)) {
      while (!(is_counted = robot.stops() > before) && since_us(begin) < 2e6) ::nanosleep(&kLook, nullptr);
      if (is_counted) result.us.push_back(since_us(begin));
    }
    if (!is_counted || !client->reply(within(kPatience_s))) client.reset();
    result.lost += is_counted ? 0 : 1;
  }
  std::sort(result.us.begin(), result.us.end());
  return result;
}

double percentile(const std::vector<double>& sorted, double share) {
  return sorted[std::min(sorted.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
}

void report(const std::string& orb, const std::string& beside, const Result& result,
            const std::string& notes) {
  double load[1] = {0.0};
  (void)::getloadavg(load, 1);
  fmt::print("{:<8} {:<34} {:>6} {:>9.0f} {:>9.0f} {:>9.0f}   {:.1f}  {}\n", orb, beside, result.us.size(),
             percentile(result.us, 0.5), percentile(result.us, 0.99), result.us.back(), load[0], notes);
  if (result.lost > 0)
    fmt::print("         {} more were sent on connections that were just being closed\n", result.lost);
}

void run(const std::string& orb, const std::string& servant, int stops) {
  const Robot robot(servant);
  (void)measure(robot, 100);  // warms up
  report(orb, "nothing", measure(robot, stops), "");
  const Load load(robot);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  const Result result = measure(robot, stops);
  report(orb, "100 busy connections and a flood", result, load.rates());
}

}  // namespace

int main(int argc, char** argv) try {
  const int stops = argc > 1 ? std::max(1, std::atoi(argv[1])) : 2000;
  (void)::prctl(PR_SET_TIMERSLACK, 1);
  utsname machine{};
  (void)::uname(&machine);
  fmt::print("From a Stop's last byte to its count; {} {}, {} processors\n", machine.sysname, machine.release,
             std::thread::hardware_concurrency());
  fmt::print("{:<8} {:<34} {:>6} {:>9} {:>9} {:>9}   load average\n", "ORB", "beside", "Stops", "p50 us",
             "p99 us", "max us");
  run("omniORB", "corbot-servant", stops);
#ifdef CORBOT_HAS_ORBIT2
  run("ORBit2", "corbot-servant-orbit2", stops);
#else
  fmt::print("ORBit2: not found\n");
#endif
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "bench_stops: {}\n", error.what());
  return 1;
}
