// SPDX-License-Identifier: Apache-2.0
// How many calls may wait for motions, who holds their places, and that a Stop gets through whatever a client
// or a thousand idle connections do.
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include <fmt/core.h>
#include <fmt/format.h>

#include "interop/matrix_client.h"
#include "shm/channel_client.h"
#include "support/giop.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

class Places : public RobotRig {
 protected:
  static constexpr int kOfAHost = 4;

  bool has_ticket(Corbot::Ticket id) {
    return raised_by([&] { Corbot::MotionInfo_var info = arm_->Progress(id); }).empty();
  }
  /// Whether one more call of this host may wait.
  bool is_free() {
    return raised_by([&] { Corbot::MotionInfo_var info = arm_->Wait(1, 0.0); }) != "QueueFull";
  }
  /// Four calls that wait, of this program; how long a Stop takes then.
  double stop_among_four() {
    const Corbot::Ticket next = arm_->StartReady() + 1;
    std::vector<std::thread> callers;
    std::atomic<int> stopped{0};
    std::atomic<bool> stopping{false};
    for (int i = 0; i < kOfAHost; ++i) {
      callers.emplace_back([&] {
        std::string raised;
        // If the machine stalls for a second, the previous Stop may count for a call that came after it.
        do raised = raised_by([&] { arm_->Delay(600.0); });
        while (raised == "Stopped" && !stopping);
        if (raised == "Stopped") ++stopped;
      });
    }
    EXPECT_TRUE(wait_until(within(30), [&] { return has_ticket(next + kOfAHost - 1); }));
    stopping = true;
    const auto begin = Clock::now();
    EXPECT_EQ(raised_by([&] { arm_->Stop(); }), "");
    const double took_s = since(begin);
    for (auto& caller : callers) caller.join();
    EXPECT_EQ(stopped, kOfAHost);
    return took_s;
  }
  using Clients = std::vector<std::unique_ptr<MatrixClient>>;
  /// One more client, in a process of its own.
  MatrixClient& add_client(Clients& clients, const std::string& reference) {
    clients.push_back(std::make_unique<MatrixClient>());
    MatrixClient& client = *clients.back();
    EXPECT_EQ(client.prepare(client_kinds().front()), "");
    client.start(fmt::format("{}/{}.{}", CORBOT_SCRATCH_DIR, name_, clients.size()));
    EXPECT_EQ(client.ask("connect " + reference), "ok");
    return client;
  }
  /// So many of them that wait.
  Clients waiting_clients(int count, const std::string& reference) {
    Clients clients;
    for (int i = 0; i < count; ++i) {
      EXPECT_EQ(add_client(clients, reference).ask("begin wait Delay 3000"), "ok");
      EXPECT_TRUE(wait_until(within(30), [&] { return has_ticket(static_cast<Corbot::Ticket>(i) + 1); }));
    }
    return clients;
  }
  /// A Stop from one process more, and what it does to those that wait.
  void stop_by_another_process(Clients& waiting, const std::string& reference) {
    const std::size_t count = waiting.size();
    MatrixClient& other = add_client(waiting, reference);
    const auto begin = Clock::now();
    EXPECT_EQ(other.ask("call Stop"), "ok");
    fmt::print("Stop of another process, among {} that wait: {:.1f} ms\n", count, 1e3 * since(begin));
    for (std::size_t i = 0; i < count; ++i)
      EXPECT_TRUE(waiting[i]->ask("end wait").starts_with("exception Stopped")) << i;
  }
  static constexpr int kFlood = 1500;
  static constexpr int kFewThreads = 150;
  struct Flood {
    int answered = 0;
    int results = 0;  ///< answers that are no exceptions
    int most_threads = 0;
  };
  /// So many calls at once, on one connection; `meanwhile` runs once they are under way.
  Flood send_many(const std::string& operation, const std::vector<double>& arguments = {},
                  const std::function<void()>& meanwhile = {}) {
    RawConnection rude(port_);
    std::string requests;
    for (int i = 0; i < kFlood; ++i)
      requests += giop_request(static_cast<std::uint32_t>(i), name_, operation, arguments);
    std::atomic<bool> end{false};
    Flood flood;
    std::thread watch([&] {
      while (!end) flood.most_threads = std::max(flood.most_threads, threads());
    });
    std::thread sender([&] { EXPECT_TRUE(rude.send(requests)); });
    std::thread other([&] {
      if (meanwhile) meanwhile();
    });
    while (flood.answered < kFlood) {
      const auto reply = rude.reply(within(60));
      if (!reply) break;
      ++flood.answered;
      if (reply->status == 0) ++flood.results;
    }
    for (std::thread* each : {&sender, &other}) each->join();
    end = true;
    watch.join();
    fmt::print("{} calls of {} at once: {} threads at most\n", kFlood, operation, flood.most_threads);
    return flood;
  }
  int descriptors() const {
    const std::filesystem::directory_iterator all(fmt::format("/proc/{}/fd", servant_->pid()));
    return static_cast<int>(std::distance(begin(all), end(all)));
  }
  int threads() const {
    const std::filesystem::directory_iterator all(fmt::format("/proc/{}/task", servant_->pid()));
    return static_cast<int>(std::distance(begin(all), end(all)));
  }
};

TEST_F(Places, ACallTooManyIsRefusedAndStartsNothing) {
  std::atomic<int> stopped{0};
  std::vector<std::thread> callers;
  for (int i = 0; i < kOfAHost; ++i) {
    callers.emplace_back([&] {
      if (raised_by([&] { arm_->Delay(600.0); }) == "Stopped") ++stopped;
    });
  }
  EXPECT_TRUE(wait_until(within(30), [&] { return has_ticket(kOfAHost); }));
  try {
    arm_->Ready();
    ADD_FAILURE() << "a fifth call waits";
  } catch (const Corbot::QueueFull& full) {
    EXPECT_EQ(full.capacity, kOfAHost);
  }
  EXPECT_FALSE(has_ticket(kOfAHost + 1));
  EXPECT_EQ(arm_->StartReady(), kOfAHost + 1u) << "what takes a moment only needs none of these";
  arm_->Stop();
  for (auto& caller : callers) caller.join();
  EXPECT_EQ(stopped, kOfAHost);
  EXPECT_TRUE(wait_until(within(30), [&] { return is_free(); }));
}

/// A class at one machine. Nothing tells which connections over TCP come from one process.
TEST_F(Places, OfFiveProcessesOverTcpTheFifthIsRefusedAndAnotherStopsThem) {
  auto clients = waiting_clients(kOfAHost, reference_);
  Clients fifth;
  EXPECT_EQ(add_client(fifth, reference_).ask("call Delay 3000"), "exception QueueFull {capacity=4}");
  EXPECT_FALSE(has_ticket(kOfAHost + 1));
  fifth.clear();
  stop_by_another_process(clients, reference_);
}

/// A robot whose queue has room for a class. Its clients come over a Unix socket, where the kernel names the
/// process.
class PlacesOfAClass : public Places {
 protected:
  void SetUp() override {
    if (on_orbit2()) GTEST_SKIP() << "skipped: no client of ours speaks ORBit2's Unix sockets";
    take_name("class");
    std::ifstream from(CORBOT_TEST_PROFILE);
    std::string text{std::istreambuf_iterator<char>{from}, {}};
    const std::string queue = "queue = 16";
    ASSERT_NE(text.find(queue), std::string::npos);
    profile_ = fmt::format("{}/{}.toml", CORBOT_SCRATCH_DIR, name_);
    std::ofstream(profile_) << text.replace(text.find(queue), queue.size(), "queue = 32");
    start_rt();
    const std::string socket = fmt::format("{}/{}.orb", CORBOT_SCRATCH_DIR, name_);
    start_servant({"--unix", socket});
    if (HasFatalFailure()) return;
    arm_ = connect();
    local_reference_ = fmt::format("corbaloc:omniunix:{}:/{}", socket, name_);
    ASSERT_TRUE(wait_for(Corbot::Standby));
  }
  void TearDown() override {
    Places::TearDown();
    if (IsSkipped()) return;  // the profile is everybody's
    std::filesystem::remove(profile_);
  }
  std::string local_reference_;
};

TEST_F(PlacesOfAClass, TwentyProcessesWaitAndAnotherStopsThem) {
  auto clients = waiting_clients(20, local_reference_);
  stop_by_another_process(clients, local_reference_);
}

/// The best of several: any of them may meet a busy machine.
TEST_F(Places, AStopAmongFourBlockedCallsIsQuick) {
  constexpr int kTries = 9;
  constexpr double kBound_s = 0.05;
  std::vector<double> took_s;
  std::vector<double> after_restart_s;
  for (int i = 0; i < kTries; ++i) took_s.push_back(stop_among_four());
  for (int i = 0; i < kTries; ++i) {
    servant_->signal(SIGKILL);
    ASSERT_TRUE(servant_->wait(within(30)));
    start_servant();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Standby));
    after_restart_s.push_back(stop_among_four());
  }
  for (auto* each : {&took_s, &after_restart_s}) std::sort(each->begin(), each->end());
  fmt::print(
      "Stop among four blocked calls: median {:.1f} ms, longest {:.1f} ms; right after a restart: median "
      "{:.1f} ms, longest {:.1f} ms\n",
      1e3 * took_s[kTries / 2], 1e3 * took_s.back(), 1e3 * after_restart_s[kTries / 2],
      1e3 * after_restart_s.back());
  EXPECT_LT(took_s.front(), kBound_s);
  EXPECT_LT(after_restart_s.front(), kBound_s);
}

/// A client that has gone, in one of several ways: how long its host's places stay taken after that. The best
/// of some runs: any may meet a machine that stands still.
class PlacesOfTheGone : public Places {
 protected:
  using Gone = void (RawConnection::*)();
  double best_of(int runs, double bound_s, Gone go) {
    std::vector<double> took_s;
    while (static_cast<int>(took_s.size()) < runs && (took_s.empty() || took_s.back() > bound_s)) {
      took_s.push_back(once(go));
      if (HasFatalFailure()) return HUGE_VAL;
    }
    std::sort(took_s.begin(), took_s.end());
    fmt::print("the places are free after {:.3f} s\n", fmt::join(took_s, ", "));
    return took_s.front();
  }

 private:
  double once(Gone go) {
    const Corbot::Ticket next = arm_->StartReady() + 1;
    std::vector<RawConnection> clients;
    for (int i = 0; i < kOfAHost; ++i) {
      clients.emplace_back(port_);
      const auto call = [&] { EXPECT_TRUE(clients.back().send(giop_request(1, name_, "Delay", {3000.0}))); };
      call();
      EXPECT_TRUE(wait_until(within(30), [&] {
        // If the machine stalls for a second, the previous Stop may count for a call that came after it.
        if (clients.back().reply(Clock::now())) call();
        return has_ticket(next + static_cast<Corbot::Ticket>(i));
      }));
    }
    EXPECT_FALSE(is_free()) << "four do not take the places of this host";
    for (RawConnection& client : clients) (client.*go)();
    const auto begin = Clock::now();
    EXPECT_TRUE(wait_until(within(60), [&] { return is_free(); }));
    const double took_s = since(begin);
    Corbot::MotionInfo_var info = arm_->Progress(next);
    EXPECT_EQ(info->state, Corbot::MotionRunning) << "the motion of a caller who is gone goes on";
    arm_->Stop();
    return took_s;
  }
};

TEST_F(PlacesOfTheGone, AreFreeWithinASecondOfTheEndOfAConnection) {
  EXPECT_LT(best_of(5, 1.0, &RawConnection::close), 1.0);
}

TEST_F(PlacesOfTheGone, AreFreeWithinASecondOfTheResetOfAConnection) {
  EXPECT_LT(best_of(5, 1.0, &RawConnection::reset), 1.0);
}

TEST_F(PlacesOfTheGone, AreFreeWithinTenSecondsOfSilence) {
  EXPECT_LT(best_of(3, 10.0, &RawConnection::fall_silent), 10.0);
}

TEST_F(Places, ThoseOfKilledClientsAreFree) {
  auto clients = waiting_clients(kOfAHost, reference_);
  EXPECT_FALSE(is_free()) << "four do not take the places of this host";
  for (auto& client : clients) client->kill();
  EXPECT_TRUE(wait_until(within(30), [&] { return is_free(); }));
  arm_->Stop();
}

TEST_F(Places, AThousandIdleConnectionsDoNotShutOutStop) {
  rlimit own{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &own), 0);
  constexpr int kConnections = 1100;
  if (own.rlim_max < kConnections + 100) GTEST_SKIP() << "skipped: fewer than 1,200 descriptors a process";
  const rlimit more{own.rlim_max, own.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &more), 0);
  const rlimit of_servant{1024, 1024};
  ASSERT_EQ(::prlimit(servant_->pid(), RLIMIT_NOFILE, &of_servant, nullptr), 0);
  std::vector<RawConnection> idle;
  for (int i = 0; i < kConnections; ++i) idle.emplace_back(port_);
  // The oldest is closed for its idleness when the last has been taken.
  EXPECT_TRUE(idle.front().closed(within(30)));
  EXPECT_TRUE(wait_until(within(30), [&] { return descriptors() < 512; })) << descriptors();
  MatrixClient client;
  ASSERT_EQ(client.prepare(client_kinds().front()), "");
  client.start(fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_));
  EXPECT_EQ(client.ask("connect " + reference_), "ok");
  EXPECT_EQ(client.ask("begin move Move 0.20 0.10 0.10 0 20"), "ok");
  EXPECT_TRUE(wait_until(within(30), [&] { return client.ask("get Status") == "ok Waiting"; }));
  EXPECT_EQ(client.ask("call Stop"), "ok");
  EXPECT_TRUE(client.ask("end move").starts_with("exception Stopped"));
  fmt::print("{} idle connections: {} descriptors, {} threads\n", kConnections, descriptors(), threads());
  EXPECT_EQ(raised_by([&] { arm_->Stop(); }), "") << "a client whose idle connection was closed";
}

/// All of them ask something all the time, so that none is idle.
TEST_F(Places, AsManyBusyConnectionsAsThereMayBeDoNotShutOutStop) {
  constexpr int kConnections = 256;
  constexpr int kTries = 9;
  std::atomic<bool> end{false};
  std::atomic<long> answers{0};
  std::atomic<long> closed{0};
  std::thread others([&] {
    std::vector<std::optional<RawConnection>> busy(kConnections);
    while (!end) {
      for (auto& each : busy) {
        if (!each) each.emplace(port_);
        (void)each->send(giop_request(1, name_, "_get_CartCoord"));
      }
      for (auto& each : busy) {
        if (each->reply(within(30))) {
          ++answers;
        } else {
          ++closed;
          each.reset();  // as a client's ORB: another one for the next call
        }
      }
    }
  });
  EXPECT_TRUE(wait_until(within(60), [&] { return answers > 2 * kConnections; }));
  std::vector<double> took_s;
  int tries = 0;
  while (took_s.size() < kTries && tries < 10 * kTries) {
    const auto begin = Clock::now();
    RawConnection client(port_);
    ++tries;
    if (!client.send(giop_request(1, name_, "Stop"))) continue;
    const auto reply = client.reply(within(30));
    if (!reply) continue;  // a client's ORB would send it again
    EXPECT_EQ(reply->status, 0u);
    took_s.push_back(since(begin));
  }
  end = true;
  others.join();
  ASSERT_EQ(took_s.size(), static_cast<std::size_t>(kTries));
  std::sort(took_s.begin(), took_s.end());
  fmt::print(
      "{} busy connections, {} answers, {} closed: a Stop on a new one in {} of {} tries, median {:.1f} ms, "
      "longest {:.1f} ms\n",
      kConnections, answers.load(), closed.load(), kTries, tries, 1e3 * took_s[kTries / 2],
      1e3 * took_s.back());
}

/// A call is being carried out on each of them.
TEST_F(Places, AsManyBlockedConnectionsAsThereMayBeDoNotShutOutStop) {
  constexpr std::uint64_t kConnections = 256;
  const Observer channel = Observer::of(name_);
  const auto stops = [&] { return channel.servant()->control.stop_count.load(); };
  const std::uint64_t before = stops();
  rt_->signal(SIGSTOP);
  std::vector<RawConnection> blocked;
  for (std::uint64_t i = 0; i < kConnections; ++i) {
    blocked.emplace_back(port_);
    EXPECT_TRUE(blocked.back().send(giop_request(1, name_, "Stop")));
  }
  EXPECT_TRUE(wait_until(within(30), [&] { return stops() >= before + kConnections; })) << stops() - before;
  const std::uint64_t then = stops();
  RawConnection client(port_);
  EXPECT_TRUE(client.send(giop_request(1, name_, "Stop")));
  EXPECT_TRUE(wait_until(within(30), [&] { return stops() > then; }));
  rt_->signal(SIGCONT);
  EXPECT_TRUE(client.reply(within(60)));
}

TEST_F(Places, ManyCallsThatStartAMotionTakeFewThreads) {
  const Flood flood = send_many("StartDelay", {600.0});
  EXPECT_EQ(flood.answered, kFlood);
  EXPECT_LT(flood.most_threads, kFewThreads);
  arm_->Stop();
}

TEST_F(Places, ManyStopsTakeFewThreadsAndAllReturnAtRest) {
  const Corbot::Ticket ticket = arm_->StartMove(0.20, 0.10, 0.10, 0, 20);
  ASSERT_TRUE(wait_for(Corbot::Waiting));
  const Flood flood = send_many("Stop");
  EXPECT_EQ(flood.answered, kFlood);
  EXPECT_EQ(flood.results, kFlood) << "refused";
  EXPECT_LT(flood.most_threads, kFewThreads);
  Corbot::MotionInfo_var info = arm_->Progress(ticket);
  EXPECT_EQ(info->state, Corbot::MotionStopped);
}

TEST_F(Places, TheAuditLogHasTheCallerOfEachOfManyStops) {
  EXPECT_EQ(servant_->terminate(), 0);
  const std::filesystem::path directory = fmt::format("{}/{}.calls", CORBOT_SCRATCH_DIR, name_);
  start_servant({"--state-dir", directory});
  ASSERT_FALSE(HasFatalFailure());
  ASSERT_TRUE(wait_for(Corbot::Standby));
  EXPECT_EQ(send_many("StopAndHold").results, kFlood);
  EXPECT_EQ(arm_->Status(), Corbot::Error);
  EXPECT_EQ(servant_->terminate(), 0);  // which writes what waits to be written
  int holds = 0;
  int stops = 0;
  int nameless = 0;
  for (const auto& file : std::filesystem::directory_iterator(directory)) {
    if (file.path().string().find(".audit") == std::string::npos) continue;
    std::ifstream lines(file.path());
    for (std::string line; std::getline(lines, line);) {
      holds += line.find("\"StopAndHold()\"") != std::string::npos;
      stops += line.find("\"Stop()\"") != std::string::npos;
      nameless += line.find("\"from\":\"127.0.0.1:") == std::string::npos;
    }
  }
  EXPECT_EQ(holds, kFlood);
  EXPECT_EQ(stops, 0) << "another call than was made";
  EXPECT_EQ(nameless, 0);
  start_servant();
  ASSERT_FALSE(HasFatalFailure());
  std::filesystem::remove_all(directory);
}

/// They wait for a task that does not answer; a Stop gets through, is counted, and carried out when the task
/// goes on.
TEST_F(Places, ManyCallsThatChangeHowTheArmMovesTakeFewThreadsAndDoNotShutOutStop) {
  const Corbot::Ticket ticket = arm_->StartDelay(600.0);
  rt_->signal(SIGSTOP);
  std::string stopped;
  const Flood flood = send_many("Pause", {}, [&] {
    std::thread stop([&] { stopped = raised_by([&] { arm_->Stop(); }); });
    stop.join();  // among them
  });
  rt_->signal(SIGCONT);
  EXPECT_EQ(flood.answered, kFlood);
  EXPECT_LT(flood.most_threads, kFewThreads);
  EXPECT_TRUE(stopped.empty() || stopped == "NotReady") << stopped;
  ASSERT_TRUE(wait_until(within(30), [&] {
    Corbot::MotionInfo_var info = arm_->Progress(ticket);
    return info->state == Corbot::MotionStopped;
  }));
}

}  // namespace
}  // namespace corbot::test
