// SPDX-License-Identifier: Apache-2.0
// Tests how long State and the end of the coordinator wait if a part of the cell is frozen.
#include "cell/coordinator/coordinator_servant.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/ports.h"
#include "support/robot_rig.h"
#include "support/running_seconds.h"
#include "unit/cell_worker/fake_cell.h"

namespace corbot::test {
namespace {

/// A port that accepts connections and never replies, as a frozen process does.
class FrozenPort {
 public:
  FrozenPort() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(socket_, 8) != 0)
      throw std::runtime_error("no port");
  }
  FrozenPort(const FrozenPort&) = delete;
  FrozenPort& operator=(const FrozenPort&) = delete;
  ~FrozenPort() { ::close(socket_); }

  const int port{free_port()};

 private:
  const int socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
};

TEST(Coordinator, AFrozenStoreHoldsUpNeitherStateNorEnd) {
  const FrozenPort store;
  cell::CellConfig config = demo_cell();
  config.store_reference = fmt::format("corbaloc::127.0.0.1:{}/Store", store.port);
  cell::CoordinatorServant coordinator(client_orb(), config, {});
  const auto ask = [&] {
    const Corbot::CoordinatorState_var state = coordinator.State();
    EXPECT_EQ(state->placed, 0U);
  };
  EXPECT_LT(running_seconds_of(ask), 2);
  EXPECT_LT(running_seconds_of([&] {
              std::vector<std::jthread> clients;
              for (int i = 0; i < 5; ++i) clients.emplace_back(ask);
            }),
            3);
  EXPECT_LT(running_seconds_of([&] { coordinator.end(); }), 2);
}

/// A store without pieces.
class EmptyStore : public POA_Corbot::Store {
 public:
  Corbot::ClaimToken Claim(const char*, const char*, Corbot::ClaimToken) override { return 1; }
  void Release(Corbot::ClaimToken) override {}
  Corbot::TransferInfo* Reserve(Corbot::ClaimToken, const char* from, const char*, const Corbot::Sightings&,
                                double) override {
    throw Corbot::Empty(from);
  }
  void Advance(Corbot::ClaimToken, Corbot::PieceNumber, Corbot::TransferStep, const char*) override {}
  void Enter(Corbot::ClaimToken, const char*, double) override {}
  void Leave(Corbot::ClaimToken, const char*) override {}
  void Resolve(Corbot::PieceNumber, const char*, CORBA::Long, const char*) override {}
  void Exchange(const char*, const char*) override {}
  Corbot::PieceEvents* Unclear() override { return new Corbot::PieceEvents; }
  Corbot::PlaceInfos* Places() override { return new Corbot::PlaceInfos; }
  Corbot::TransferInfos* Transfers() override { return new Corbot::TransferInfos; }
  Corbot::PieceEvents* History(Corbot::PieceNumber, CORBA::ULongLong) override {
    return new Corbot::PieceEvents;
  }
};

/// Two arms and a store in this process. `first_` is the first arm's servant.
class TwoArms : public RobotRig {
 protected:
  void SetUp() override {
    RobotRig::SetUp();
    if (HasFatalFailure()) return;
    config_.robots[0].reference = reference_;
    first_rt_ = std::move(rt_);
    first_ = std::move(servant_);
    first_arm_ = arm_;
    RobotRig::SetUp();
    config_.robots[1].reference = reference_;
    const CORBA::Object_var object = client_orb()->resolve_initial_references("RootPOA");
    poa_ = PortableServer::POA::_narrow(object);
    const PortableServer::POAManager_var manager = poa_->the_POAManager();
    manager->activate();
    id_ = poa_->activate_object(&store_);
    const CORBA::Object_var reference = poa_->id_to_reference(id_);
    const CORBA::String_var text = client_orb()->object_to_string(reference.in());
    config_.store_reference = text.in();
    for (cell::CellRobot& robot : config_.robots) robot.speed_percent = 1;
    std::filesystem::remove(config_.hold_file());  // left by the previous test
  }
  void TearDown() override {
    poa_->deactivate_object(id_);
    RobotRig::TearDown();
    first_arm_ = Corbot::Arm::_nil();
    EXPECT_EQ(first_->terminate(), 0) << first_->errors();
    EXPECT_EQ(first_rt_->terminate(), 0) << first_rt_->errors();
  }
  [[nodiscard]] static bool is_held(const Corbot::Arm_var& arm) {
    const Corbot::ControlInfo_var control = arm->Control();
    return *control->holder.in() != 0;
  }

  cell::CellConfig config_ = demo_cell();
  std::unique_ptr<Process> first_rt_;
  std::unique_ptr<Process> first_;
  Corbot::Arm_var first_arm_;

 private:
  EmptyStore store_;
  PortableServer::POA_var poa_;
  PortableServer::ObjectId_var id_;
};

TEST_F(TwoArms, AFrozenServantDoesNotKeepStopFromTheOtherRobot) {
  cell::CoordinatorServant coordinator(client_orb(), config_, {"robot1", "robot2"});
  coordinator.Start();
  const auto moves = [](const Corbot::Arm_var& arm) { return arm->Status() == Corbot::Waiting; };
  ASSERT_TRUE(wait_until(within(20), [&] { return moves(first_arm_) && moves(arm_); }));
  std::this_thread::sleep_for(std::chrono::seconds(1));  // the gripper opens first
  ASSERT_TRUE(moves(arm_));
  first_->signal(SIGSTOP);
  auto end = std::async(std::launch::async, [&] { coordinator.end(); });
  EXPECT_TRUE(wait_for(Corbot::Standby, 1.5));
  EXPECT_TRUE(wait_until(within(1.5), [&] { return !is_held(arm_); })) << "control is not given back";
  first_->signal(SIGCONT);
  EXPECT_EQ(end.wait_for(std::chrono::seconds(8)), std::future_status::ready);
}

TEST_F(TwoArms, AStopDoesNotWaitForTheDisk) {
  cell::CoordinatorServant coordinator(client_orb(), config_, {"robot1", "robot2"});
  const auto moves = [](const Corbot::Arm_var& arm) { return arm->Status() == Corbot::Waiting; };
  coordinator.Start();
  ASSERT_TRUE(wait_until(within(20), [&] { return moves(first_arm_) && moves(arm_); }));
  std::this_thread::sleep_for(std::chrono::seconds(1));  // the gripper opens first
  ASSERT_TRUE(moves(first_arm_) && moves(arm_));
  const std::string file = config_.hold_file();
  std::filesystem::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);  // opening it waits for a reader
  auto stop = std::async(std::launch::async, [&] { coordinator.Stop(); });
  EXPECT_TRUE(wait_for(Corbot::Standby, 1.5));
  EXPECT_TRUE(wait_until(within(1.5), [&] { return !moves(first_arm_); }));
  EXPECT_NE(stop.wait_for(std::chrono::seconds(0)), std::future_status::ready) << "the hold is not kept yet";
  const int reader = ::open(file.c_str(), O_RDONLY | O_NONBLOCK);
  EXPECT_EQ(raised_by([&] { stop.get(); }), "");
  ::close(reader);
  std::filesystem::remove(file);
  coordinator.end();
}

TEST_F(TwoArms, NoRobotBeginsAMotionBetweenPauseAndResume) {
  cell::CoordinatorServant coordinator(client_orb(), config_, {"robot1", "robot2"});
  const auto moves = [](const Corbot::Arm_var& arm) { return arm->Status() == Corbot::Waiting; };
  const auto any_moves = [&] { return moves(first_arm_) || moves(arm_); };
  coordinator.Pause();
  EXPECT_TRUE(coordinator.Paused());
  coordinator.Start();
  ASSERT_TRUE(wait_until(within(20), [&] { return is_held(first_arm_) && is_held(arm_); }));
  EXPECT_FALSE(wait_until(within(1), any_moves));
  std::map<std::string, cell::Activity> activities;
  for (const cell::ActivityChange& change : cell::read_activity(config_.activity_file()))
    activities[change.robot] = change.activity;
  EXPECT_EQ(activities["robot1"], cell::Activity::kIdle);
  EXPECT_EQ(activities["robot2"], cell::Activity::kIdle);
  coordinator.Resume();
  EXPECT_FALSE(coordinator.Paused());
  EXPECT_TRUE(wait_until(within(20), any_moves));
  coordinator.Pause();
  EXPECT_LT(running_seconds_of([&] { coordinator.end(); }), 8) << "robots that are paused end, too";
}

}  // namespace
}  // namespace corbot::test
