// SPDX-License-Identifier: Apache-2.0
// How many calls may wait for motions, who holds their places, and that a Stop gets through whatever a client
// or a thousand idle connections do.
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include <fmt/core.h>

#include "interop/matrix_client.h"
#include "support/cut_proxy.h"
#include "support/giop.h"
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
    for (int i = 0; i < kOfAHost; ++i) {
      callers.emplace_back([&] {
        if (raised_by([&] { arm_->Delay(600.0); }) == "Stopped") ++stopped;
      });
    }
    EXPECT_TRUE(wait_until(within(30), [&] { return has_ticket(next + kOfAHost - 1); }));
    const auto begin = Clock::now();
    EXPECT_EQ(raised_by([&] { arm_->Stop(); }), "");
    const double took_s = since(begin);
    for (auto& caller : callers) caller.join();
    EXPECT_EQ(stopped, kOfAHost);
    return took_s;
  }
  /// Four clients in processes of their own that wait; `port`: where they connect.
  std::vector<std::unique_ptr<MatrixClient>> waiting_clients(int port) {
    std::vector<std::unique_ptr<MatrixClient>> clients;
    for (int i = 0; i < kOfAHost; ++i) {
      clients.push_back(std::make_unique<MatrixClient>());
      EXPECT_EQ(clients.back()->prepare(client_kinds().front()), "");
      clients.back()->start(fmt::format("{}/{}.{}", CORBOT_SCRATCH_DIR, name_, i));
      EXPECT_EQ(clients.back()->ask(fmt::format("connect corbaloc::1.2@127.0.0.1:{}/{}", port, name_)), "ok");
      EXPECT_EQ(clients.back()->ask("begin wait Delay 3000"), "ok");
      EXPECT_TRUE(wait_until(within(30), [&] { return has_ticket(static_cast<Corbot::Ticket>(i) + 1); }));
    }
    EXPECT_FALSE(is_free()) << "four do not take the places of this host";
    return clients;
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
  EXPECT_EQ(arm_->StartReady(), kOfAHost + 1u) << "what does not wait finds places of its own";
  arm_->Stop();
  for (auto& caller : callers) caller.join();
  EXPECT_EQ(stopped, kOfAHost);
  EXPECT_TRUE(wait_until(within(30), [&] { return is_free(); }));
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

TEST_F(Places, ThoseOfKilledClientsAreFreeAtOnce) {
  auto clients = waiting_clients(port_);
  for (auto& client : clients) client->kill();
  const auto begin = Clock::now();
  EXPECT_TRUE(wait_until(within(30), [&] { return is_free(); }));
  fmt::print("free after {:.0f} ms\n", 1e3 * since(begin));
  Corbot::MotionInfo_var info = arm_->Progress(1);
  EXPECT_EQ(info->state, Corbot::MotionRunning) << "the motion of a caller who is gone goes on";
  arm_->Stop();
}

TEST_F(Places, ThoseOfClientsThatFallSilentAreFreeWithinTenSeconds) {
  CutProxy proxy(port_);
  auto clients = waiting_clients(proxy.port());
  proxy.fall_silent();
  const auto begin = Clock::now();
  EXPECT_TRUE(wait_until(within(30), [&] { return is_free(); }));
  fmt::print("free after {:.1f} s\n", since(begin));
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
