// SPDX-License-Identifier: Apache-2.0
// Cuts the connection of a motion's call at any place. The places are within the request, after the servant
// has read it and before it plans, within the reply, and before the sent reply arrives. The arm moves at most
// once, and the client's outcome agrees with that. No reply of the servant forwards a client.
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "interop/matrix_client.h"
#include "support/cut_proxy.h"
#include "support/ior.h"
#include "support/naming_service.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using Part = CutPoint::Part;

struct Place {
  Part part;
  double share;  // of the message's bytes
};
/// A request ends one byte too early at the latest; of a reply nothing has arrived, or not all.
constexpr Place kPlaces[] = {{Part::kRequest, 0.05}, {Part::kRequest, 0.5}, {Part::kRequest, 0.999},
                             {Part::kRequest, 1.0},  {Part::kReply, 0.0},   {Part::kReply, 0.5},
                             {Part::kReply, 0.999}};

class CutRig : public RobotRig {
 protected:
  void SetUp() override {
    RobotRig::SetUp();
    if (HasFatalFailure()) return;
    proxy_ = std::make_unique<CutProxy>(port_);
  }
  void TearDown() override {
    if (proxy_) {
      EXPECT_GT(proxy_->replies(), 0);
      EXPECT_EQ(proxy_->forwards(), 0) << "whose connection is lost may send a call again";
    }
    proxy_.reset();
    if (rt_) RobotRig::TearDown();
  }
  [[nodiscard]] std::string corbaloc() const {
    return fmt::format("corbaloc::1.2@127.0.0.1:{}/{}", proxy_->port(), name_);
  }
  [[nodiscard]] std::string through_proxy(CORBA::Object_ptr object) const {
    const CORBA::String_var text = client_orb()->object_to_string(object);
    Ior ior = parse_ior(text.in());
    ior.port = proxy_->port();
    return to_string(ior);
  }
  [[nodiscard]] bool has_ticket(Corbot::Ticket id) const {
    return raised_by([&] { Corbot::MotionInfo_var info = arm_->Progress(id); }).empty();
  }
  [[nodiscard]] double joint_0() const {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    return joints[0];
  }
  /// Every connection of the servant has a peer: what came on those that were cut has been read, or never
  /// will be.
  [[nodiscard]] bool has_settled() const {
    std::set<std::string> good;
    for (const char* table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
      std::ifstream stream(table);
      std::string row;
      std::getline(stream, row);  // the names of the columns
      while (std::getline(stream, row)) {
        std::istringstream words(row);
        const std::vector<std::string> column{std::istream_iterator<std::string>(words), {}};
        if (column.size() < 10) continue;
        const bool lives = column[3] == "01" || column[3] == "0A";  // established, listening
        if (lives) good.insert(column[9]);
        if (!lives && column[3] == "08" && column[1].ends_with(fmt::format(":{:04X}", port_))) return false;
      }
    }
    std::ifstream stream("/proc/net/unix");
    for (std::string row; std::getline(stream, row);) {
      std::istringstream words(row);
      const std::vector<std::string> column{std::istream_iterator<std::string>(words), {}};
      if (column.size() > 6) good.insert(column[6]);
    }
    std::error_code gone;
    for (const auto& entry :
         std::filesystem::directory_iterator(fmt::format("/proc/{}/fd", servant_->pid()))) {
      const std::string target = std::filesystem::read_symlink(entry.path(), gone).string();
      if (gone || !target.starts_with("socket:[")) continue;
      if (!good.contains(target.substr(8, target.size() - 9))) return false;
    }
    return true;
  }
  /// Returns how often `call`, which drives joint 0 by `by_deg`, has moved the arm. A request that was read,
  /// but not admitted when control is given to another client, is never carried out.
  int moves_of(const std::function<void()>& call, double by_deg) {
    const double before = joint_0();
    call();
    EXPECT_TRUE(wait_until(within(60), [&] { return has_settled(); }));
    Corbot::Arm_var control;
    EXPECT_TRUE(wait_until(within(60), [&] {
      return raised_by([&] { control = arm_->Acquire("test", 600.0); }).empty();
    })) << "motions complete when their caller is gone";
    const double moved = (joint_0() - before) / by_deg;
    int done = 0;
    for (; has_ticket(next_); ++next_) {
      Corbot::MotionInfo_var info = arm_->Progress(next_);
      if (info->state == Corbot::MotionDone) {
        ++done;
      } else {  // admitted after the Release that ended the look before
        EXPECT_EQ(info->state, Corbot::MotionStopped) << info->reason;
      }
    }
    EXPECT_NEAR(moved, done, 1e-6);
    EXPECT_LE(done, 1) << "carried out twice";
    if (!CORBA::is_nil(control)) control->Release();
    return done;
  }
  static std::string describe(const Place& place, bool resets) {
    return fmt::format("{} % of the {}, then {}", 100.0 * place.share,
                       place.part == Part::kRequest ? "request" : "reply", resets ? "RST" : "FIN");
  }

  std::unique_ptr<CutProxy> proxy_;
  Corbot::Ticket next_{1};
};

class CutCalls : public CutRig, public ::testing::WithParamInterface<ClientKind> {
 protected:
  void SetUp() override {
    if (const std::string why = client_.prepare(GetParam()); !why.empty()) GTEST_SKIP() << "skipped: " << why;
    CutRig::SetUp();
    if (HasFatalFailure()) return;
    client_.start(fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_));
  }
  void TearDown() override {
    client_.stop();
    CutRig::TearDown();
  }
  void connect_client(const std::string& how) {
    ASSERT_EQ(client_.ask(how), "ok");
    ASSERT_EQ(client_.ask("get DoF"), "ok 4");  // some ask the server for the object first, and once
  }
  /// A client that has lost a connection opens another.
  bool is_back() {
    return wait_until(within(60), [&] { return client_.ask("get DoF") == "ok 4"; });
  }
  std::string next_drive() {
    by_deg_ = -by_deg_;
    return fmt::format("Drive 0 {} 90", by_deg_);
  }
  void expect_agreement(const std::string& heard, int moves, const Place& place) {
    if (heard == "ok") {
      EXPECT_EQ(moves, 1) << "success of nothing";
      return;
    }
    EXPECT_TRUE(heard.starts_with("exception SYSTEM")) << heard;
    if (place.part == Part::kReply) {
      EXPECT_EQ(moves, 1) << "it was carried out";
    } else if (place.share < 1.0) {
      EXPECT_EQ(moves, 0) << "a request that was never whole";
    }
  }
  void cut_everywhere() {
    for (const Place& place : kPlaces) {
      for (const bool resets : {false, true}) {
        SCOPED_TRACE(describe(place, resets));
        proxy_->cut_at({"Drive", place.part, place.share, resets});
        std::string heard;
        const std::string drive = next_drive();
        const int moves = moves_of([&] { heard = client_.ask("call " + drive); }, by_deg_);
        EXPECT_TRUE(proxy_->is_cut());
        expect_agreement(heard, moves, place);
        ASSERT_TRUE(is_back());
      }
    }
  }

  MatrixClient client_;
  double by_deg_{2.0};
};

TEST_P(CutCalls, OfACorbaloc) {
  connect_client("connect " + corbaloc());
  if (!HasFatalFailure()) cut_everywhere();
}

TEST_P(CutCalls, OfAReferenceFromTheNamingService) {
  const NamingService service;
  EXPECT_EQ(servant_->terminate(), 0);
  start_servant({"--naming", service.reference()});
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_for(Corbot::Standby));
  ASSERT_TRUE(wait_until(within(30), [&] { return service.knows(name_); }));
  CORBA::Object_var published = service.resolve(name_);
  CORBA::Object_var relayed = client_orb()->string_to_object(through_proxy(published).c_str());
  service.bind(name_ + "-relayed", relayed);
  connect_client(fmt::format("resolve {} Robots/{}-relayed.Robot", service.reference(), name_));
  if (!HasFatalFailure()) cut_everywhere();
}

/// The whole request lies in the socket of a servant that does not run.
TEST_P(CutCalls, BeforeAnythingIsPlanned) {
  connect_client("connect " + corbaloc());
  if (HasFatalFailure()) return;
  for (const bool resets : {false, true}) {
    const Place place{Part::kRequest, 1.0};
    SCOPED_TRACE(describe(place, resets));
    proxy_->cut_at({"Drive", place.part, place.share, resets});
    const std::string drive = next_drive();
    std::string heard;
    const int moves = moves_of(
        [&] {
          servant_->signal(SIGSTOP);
          EXPECT_EQ(client_.ask("begin cut " + drive), "ok");
          EXPECT_TRUE(wait_until(within(30), [&] { return proxy_->is_cut(); }));
          servant_->signal(SIGCONT);
          heard = client_.ask("end cut");
        },
        by_deg_);
    expect_agreement(heard, moves, place);
    ASSERT_TRUE(is_back());
  }
}

INSTANTIATE_TEST_SUITE_P(Clients, CutCalls, ::testing::ValuesIn(client_kinds()),
                         [](const auto& test) { return test.param.name; });

/// Tests the completion status of the exception, and whether it invites the client to call again.
TEST_F(CutRig, TheExceptionIsTrue) {
  Corbot::Arm_var arm = connect(corbaloc());
  ASSERT_FALSE(CORBA::is_nil(arm));
  double by_deg = 2.0;
  for (const Place& place : kPlaces) {
    for (const bool resets : {false, true}) {
      SCOPED_TRACE(describe(place, resets));
      by_deg = -by_deg;
      proxy_->cut_at({"StartDrive", place.part, place.share, resets});
      std::string heard;
      CORBA::CompletionStatus completed = CORBA::COMPLETED_YES;
      const int moves = moves_of(
          [&] {
            try {
              arm->StartDrive(0, by_deg, 90);
            } catch (const CORBA::SystemException& e) {
              heard = e._name();
              completed = e.completed();
            }
          },
          by_deg);
      EXPECT_TRUE(proxy_->is_cut());
      if (moves == 1) {
        EXPECT_NE(completed, CORBA::COMPLETED_NO) << heard;
        EXPECT_NE(heard, "TRANSIENT") << "call again";
      } else {
        EXPECT_NE(completed, CORBA::COMPLETED_YES) << heard;
      }
    }
  }
}

}  // namespace
}  // namespace corbot::test
