// SPDX-License-Identifier: Apache-2.0
// How many calls may wait for motions, who holds their places, and that a Stop gets through whatever a client
// or a thousand idle connections do.
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
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

TEST_F(Places, AStopAmongFourBlockedCallsIsQuick) {
  std::vector<double> took_s;
  for (int i = 0; i < 9; ++i) took_s.push_back(stop_among_four());
  std::sort(took_s.begin(), took_s.end());
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(10)));
  start_servant();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_for(Corbot::Standby));
  const double after_restart_s = stop_among_four();
  fmt::print(
      "Stop among four blocked calls: median {:.1f} ms, longest {:.1f} ms; after a restart {:.1f} ms\n",
      1e3 * took_s[4], 1e3 * took_s.back(), 1e3 * after_restart_s);
  EXPECT_LT(took_s[4], 1.0) << "a Stop that waits for one of the calls takes minutes";
  EXPECT_LT(after_restart_s, 2.0);
}

TEST_F(Places, ThoseOfKilledClientsAreFreeAtOnce) {
  auto clients = waiting_clients(port_);
  for (auto& client : clients) client->kill();
  const auto begin = Clock::now();
  EXPECT_TRUE(wait_until(within(10), [&] { return is_free(); }));
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
  RawConnection rude(port_);
  constexpr int kCalls = 1500;
  std::string flood;
  for (int i = 0; i < kCalls; ++i)
    flood += giop_request(static_cast<std::uint32_t>(i), name_, "StartDelay", {600.0});
  std::atomic<bool> end{false};
  int most = 0;
  std::thread watch([&] {
    while (!end) most = std::max(most, threads());
  });
  std::thread sender([&] { EXPECT_TRUE(rude.send(flood)); });
  int answered = 0;
  while (answered < kCalls && rude.reply(within(30))) ++answered;
  sender.join();
  end = true;
  watch.join();
  fmt::print("{} calls at once: {} threads at most\n", kCalls, most);
  EXPECT_EQ(answered, kCalls);
  EXPECT_LT(most, 150);
  arm_->Stop();
}

}  // namespace
}  // namespace corbot::test
