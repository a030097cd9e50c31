// SPDX-License-Identifier: Apache-2.0
// Tests exclusive control from the clients' side: the holder moves the arm, and every client reads and stops
// it. Only the key that was given out is of any use.
#include <gmock/gmock.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include <fmt/core.h>

#include "controlled_operations.h"
#include "support/escaped_exception.h"
#include "support/giop.h"
#include "support/ior.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kLongLease_s = 600.0;
constexpr std::size_t kKeyLength = 32;

/// The reason of the NotReady that `call` raises; another exception's name, "" for none.
template <class Call>
std::string reason_of(Call&& call) {
  try {
    call();
  } catch (const Corbot::NotReady& e) {
    return e.reason.in();
  } catch (const CORBA::Exception& e) {
    return e._name();
  }
  return "";
}

/// The minor code of the NO_PERMISSION that `call` raises; 0: another end.
template <class Call>
CORBA::ULong no_permission(Call&& call) {
  try {
    call();
  } catch (const CORBA::NO_PERMISSION& e) {
    EXPECT_EQ(e.completed(), CORBA::COMPLETED_NO);
    return e.minor();
  } catch (const CORBA::Exception& e) {
    ADD_FAILURE() << described(e);
  }
  return 0;
}

class Control : public RobotRig {
 protected:
  std::string holder() const {
    Corbot::ControlInfo_var info = arm_->Control();
    return info->holder.in();
  }
  static Ior ior_of(Corbot::Arm_ptr arm) {
    CORBA::String_var text = client_orb()->object_to_string(arm);
    return parse_ior(text.in());
  }
  static Corbot::Arm_var arm_of(const Ior& ior) {
    CORBA::Object_var object = client_orb()->string_to_object(to_string(ior).c_str());
    return Corbot::Arm::_unchecked_narrow(object);
  }
  Corbot::MotionState state_of(Corbot::Ticket ticket) const {
    Corbot::MotionInfo_var info = arm_->Progress(ticket);
    return info->state;
  }
  /// A motion of many seconds, under way.
  Corbot::Ticket long_motion(Corbot::Arm_ptr by) {
    const Corbot::Ticket ticket = by->StartDrive(0, 80, 2);
    EXPECT_TRUE(wait_until(within(30), [&] { return state_of(ticket) == Corbot::MotionRunning; }));
    return ticket;
  }
  /// Everyone may, whatever reference it is.
  void expect_free(Corbot::Arm_ptr arm) {
    EXPECT_EQ(arm->DoF(), 4);
    EXPECT_EQ(arm->OverridePercent(), 100.0);
    Corbot::JointCoord_var joints = arm->ArtiCoord();
    EXPECT_EQ(joints->length(), 4u);
    Corbot::AlarmList_var alarms = arm->Alarms();
    Corbot::ControlInfo_var control = arm->Control();
    arm->Stop();
    arm->Clear();
  }
  void expect_refused(Corbot::Arm_ptr arm, const std::string& reason, CORBA::ULong minor) {
    for (const Operation& each : guarded_operations())
      EXPECT_THAT(reason_of([&] { each.second(arm); }), HasSubstr(reason)) << each.first;
    for (const Operation& each : settings())
      EXPECT_EQ(no_permission([&] { each.second(arm); }), minor) << each.first;
  }
};

TEST_F(Control, IsItsHoldersOnly) {
  EXPECT_EQ(holder(), "");
  Corbot::Arm_var mine = arm_->Acquire("cell 7", kLongLease_s);
  ASSERT_FALSE(CORBA::is_nil(mine));
  for (const Operation& each : guarded_operations())
    EXPECT_EQ(reason_of([&] { each.second(mine); }), "") << each.first;
  mine->Override(100);
  for (const Operation& each : settings()) EXPECT_EQ(raised_by([&] { each.second(mine); }), "") << each.first;
  EXPECT_EQ(reason_of([&] { mine->Renew(); }), "");
  Corbot::ControlInfo_var info = arm_->Control();
  EXPECT_STREQ(info->holder, "cell 7");
  EXPECT_GT(info->left, 0.0);
  EXPECT_LE(info->left, kLongLease_s);
  EXPECT_FALSE(info->held);
  expect_refused(arm_, "'cell 7' has control of the arm, for another ", Corbot::NoPermissionNoControl);
  EXPECT_THAT(reason_of([&] { Corbot::Arm_var second = arm_->Acquire("another", 1.0); }),
              HasSubstr("'cell 7' has control"));
  for (const std::string& reason : {reason_of([&] { arm_->Renew(); }), reason_of([&] { arm_->Release(); })})
    EXPECT_EQ(reason,
              "this reference never had control of the arm: it is for the one that Acquire has returned");
  expect_free(arm_);
  expect_free(mine);
  EXPECT_EQ(holder(), "cell 7") << "a Stop and a Clear leave control where it is";
  mine->Drive(0, 1, 20);
}

TEST_F(Control, WithoutOneTheArmIsEveryones) {
  for (const Operation& each : guarded_operations())
    EXPECT_EQ(reason_of([&] { each.second(arm_); }), "") << each.first;
}

TEST_F(Control, ChecksNameAndLease) {
  const std::string longest(64, 'x');
  for (const std::string& who : {std::string(), longest + "x", std::string("a\nb"), std::string("\xe9")})
    EXPECT_EQ(raised_by([&] { Corbot::Arm_var none = arm_->Acquire(who.c_str(), 1.0); }), "BadParameter")
        << who;
  for (const double lease : {0.0, 0.49, 3601.0, -1.0, HUGE_VAL, std::nan("")})
    EXPECT_EQ(raised_by([&] { Corbot::Arm_var none = arm_->Acquire("x", lease); }), "BadParameter") << lease;
  EXPECT_EQ(holder(), "");
  EXPECT_EQ(raised_by([&] { Corbot::Arm_var shortest = arm_->Acquire("x", 0.5); }), "");
  ASSERT_TRUE(wait_until(within(30), [&] { return holder().empty(); }));
  Corbot::Arm_var mine = arm_->Acquire(longest.c_str(), kLongLease_s);
  EXPECT_EQ(holder(), longest);
}

TEST_F(Control, ReleaseStopsTheArmAndEndsTheReference) {
  Corbot::Arm_var mine = arm_->Acquire("first", kLongLease_s);
  const Corbot::Ticket ticket = long_motion(mine);
  mine->Release();
  EXPECT_EQ(state_of(ticket), Corbot::MotionStopped);
  EXPECT_EQ(arm_->Status(), Corbot::Standby) << "Release returns at rest";
  EXPECT_EQ(holder(), "");
  expect_refused(mine, "control has ended", Corbot::NoPermissionControlEnded);
  EXPECT_THAT(reason_of([&] { mine->Renew(); }), HasSubstr("control has ended"));
  EXPECT_THAT(reason_of([&] { mine->Release(); }), HasSubstr("control has ended"));
  expect_free(mine);
  arm_->Drive(0, 1, 20);

  Corbot::Arm_var next = arm_->Acquire("second", kLongLease_s);
  expect_refused(mine, "control has ended", Corbot::NoPermissionControlEnded);
  next->Drive(0, 1, 20);
}

TEST_F(Control, IsNotGivenWhileMotionsOfOthersAreUnderWay) {
  const Corbot::Ticket ticket = long_motion(arm_);
  EXPECT_EQ(reason_of([&] { Corbot::Arm_var none = arm_->Acquire("cell 7", kLongLease_s); }),
            "a motion of others is still under way: call again when the arm is at rest, or Stop it");
  EXPECT_EQ(holder(), "");
  EXPECT_EQ(state_of(ticket), Corbot::MotionRunning) << "it stops nothing";
  arm_->Stop();
  Corbot::Arm_var mine = arm_->Acquire("cell 7", kLongLease_s);
}

TEST_F(Control, AReleaseThatCouldNotStopTheArmSaysSo) {
  Corbot::Arm_var mine = arm_->Acquire("first", kLongLease_s);
  const Corbot::Ticket ticket = long_motion(mine);
  rt_->signal(SIGSTOP);
  EXPECT_THAT(reason_of([&] { mine->Release(); }),
              HasSubstr("control has ended, but the servant cannot confirm that the arm has stopped: "));
  EXPECT_EQ(holder(), "") << "it has ended all the same";
  rt_->signal(SIGCONT);
  EXPECT_TRUE(wait_until(within(30), [&] { return state_of(ticket) != Corbot::MotionRunning; }));
}

TEST_F(Control, ALeaseThatRunsOutStopsTheArm) {
  Corbot::Arm_var mine;
  Corbot::Ticket ticket = 0;
  // The machine may stand still for the lease: until a motion is begun within it.
  ASSERT_TRUE(wait_until(within(60), [&] {
    return reason_of([&] {
             mine = arm_->Acquire("first", 1.0);
             ticket = mine->StartDrive(0, 80, 2);
           }) == "";
  }));
  // Reads through the reference are no use of it.
  EXPECT_TRUE(wait_until(within(30), [&] {
    (void)mine->Status();
    return state_of(ticket) == Corbot::MotionStopped;
  }));
  EXPECT_TRUE(wait_until(within(30), [&] { return holder().empty(); }));
  EXPECT_THAT(reason_of([&] { mine->Drive(0, 1, 20); }), HasSubstr("control has ended"));
  Corbot::Arm_var next = arm_->Acquire("second", kLongLease_s);
  next->Drive(0, 1, 20);
}

TEST_F(Control, ALeaseDoesNotRunOutDuringAMotionThatIsWaitedFor) {
  // The machine may stand still for the lease before the motion is begun: until one is done.
  double by_deg = 20.0;
  EXPECT_TRUE(wait_until(within(60), [&] {
    by_deg = -by_deg;
    return reason_of([&] {
             Corbot::Arm_var mine = arm_->Acquire("first", 0.5);
             mine->Drive(0, by_deg, 10);  // two seconds
           }) == "";
  }));
}

TEST_F(Control, OutlivesTheServant) {
  Corbot::Arm_var mine = arm_->Acquire("first", kLongLease_s);
  servant_->signal(SIGKILL);
  servant_->wait(within(30));
  start_servant();
  ASSERT_TRUE(wait_for(Corbot::Standby));
  EXPECT_EQ(holder(), "first");
  EXPECT_EQ(reason_of([&] { mine->Drive(0, 1, 20); }), "");
  EXPECT_THAT(reason_of([&] { arm_->Drive(0, 1, 20); }), HasSubstr("'first' has control"));
  EXPECT_EQ(servant_->terminate(), 0);
  start_servant();
  ASSERT_TRUE(wait_for(Corbot::Standby));
  EXPECT_EQ(reason_of([&] { mine->Release(); }), "");
  arm_->Drive(0, 1, 20);
}

TEST_F(Control, StopAndHoldLastsUntilClear) {
  Corbot::Arm_var mine = arm_->Acquire("first", kLongLease_s);
  const Corbot::Ticket ticket = long_motion(mine);
  arm_->StopAndHold();
  EXPECT_EQ(state_of(ticket), Corbot::MotionStopped);
  EXPECT_EQ(arm_->Status(), Corbot::Error);
  Corbot::ControlInfo_var info = arm_->Control();
  EXPECT_TRUE(info->held);
  EXPECT_STREQ(info->holder, "first");
  EXPECT_NE(reason_of([&] { mine->Drive(0, 1, 20); }), "");
  EXPECT_NE(reason_of([&] { mine->Ready(); }), "");
  mine->Stop();
  arm_->StopAndHold();
  EXPECT_EQ(arm_->Status(), Corbot::Error);
  arm_->Clear();
  EXPECT_EQ(arm_->Status(), Corbot::Standby);
  info = arm_->Control();
  EXPECT_FALSE(info->held);
  mine->Drive(0, 1, 20);
}

/// Returns invalid keys, made from a valid one.
std::vector<std::pair<std::string, std::string>> bad_keys(const std::string& good) {
  std::string swapped = good;
  swapped.back() = swapped.back() == '0' ? '1' : '0';
  std::string with_zero = good;
  with_zero[20] = '\0';
  std::string upper = good;
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  if (upper == good) upper[0] = 'A';
  return {{"never given", std::string(kKeyLength, '0')},
          {"one digit changed", swapped},
          {"empty", ""},
          {"truncated", good.substr(0, kKeyLength - 1)},
          {"one character", good.substr(0, 1)},
          {"one too many", good + "0"},
          {"with a zero behind", good + '\0'},
          {"zero and more behind", good + '\0' + "x"},
          {"zero within", with_zero},
          {"zeros", std::string(kKeyLength, '\0')},
          {"binary", std::string(kKeyLength, '\xff')},
          {"upper case", upper},
          {"slash before", "/" + good},
          {"long", std::string(4000, 'a')}};
}

/// A reply but its request's number.
std::string answer(RawConnection& connection, const std::string& key, const std::string& operation,
                   const std::vector<double>& arguments = {}) {
  if (!connection.send(giop_request(1, key, operation, arguments))) return "not sent";
  const auto reply = connection.reply(within(30));
  return reply ? fmt::format("{} {}", reply->status, reply->body) : "no reply";
}

TEST_F(Control, NoOtherKeyIsOfAnyUse) {
  const Ior ended = [&] {
    Corbot::Arm_var arm = arm_->Acquire("ended", kLongLease_s);
    arm->Release();
    return ior_of(arm);
  }();
  const auto answers_of = [&](const std::string& object_key) {
    RawConnection connection(port_);
    return answer(connection, object_key, "Renew") + answer(connection, object_key, "StartReady") +
           answer(connection, object_key, "Speed", {50.0});
  };
  Corbot::Arm_var mine = arm_->Acquire("holder", kLongLease_s);
  const std::string good = ior_of(mine).key;
  const std::string prefix = good.substr(0, good.size() - kKeyLength);
  const std::string refused = answers_of(ended.key);
  EXPECT_THAT(refused, AllOf(HasSubstr("IDL:Corbot/NotReady:1.0"), HasSubstr("control has ended"),
                             HasSubstr("NO_PERMISSION")));
  for (const auto& [what, key] : bad_keys(good.substr(prefix.size())))
    EXPECT_EQ(answers_of(prefix + key), refused) << what;

  // Nor is the key elsewhere than behind the name of its robot.
  std::string other_robot = good;
  other_robot[good.find(name_)] ^= 1;
  for (const std::string& key :
       {other_robot, good.substr(prefix.size()), prefix.substr(0, prefix.size() - 1) + "x"})
    EXPECT_THAT(answers_of(key), AllOf(HasSubstr("OBJECT_NOT_EXIST"), ::testing::Not(HasSubstr("NotReady"))))
        << key;
  mine->Drive(0, 1, 20);
}

TEST_F(Control, AFloodOfWrongKeysChangesNothing) {
  constexpr int kConnections = 8;
  constexpr int kRequests = 1000;
  Corbot::Arm_var mine = arm_->Acquire("holder", kLongLease_s);
  const std::string good = ior_of(mine).key;
  const std::string prefix = good.substr(0, good.size() - kKeyLength);
  std::atomic<int> refused{0};
  std::vector<std::thread> threads;
  for (int c = 0; c < kConnections; ++c) {
    threads.emplace_back([&, c] {
      RawConnection connection(port_);
      for (int i = 0; i < kRequests; ++i) {
        const std::string key = fmt::format("{:032x}", c * kRequests + i);
        const std::string heard = answer(connection, prefix + key, i % 2 == 0 ? "StartReady" : "Pause");
        if (heard.find("IDL:Corbot/NotReady:1.0") != std::string::npos) ++refused;
      }
    });
  }
  int moved = 0;
  while (refused < kConnections * kRequests / 2 && moved < 10'000) {
    mine->Delay(0.0);
    ++moved;
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(refused, kConnections * kRequests);
  EXPECT_GT(moved, 0);
  EXPECT_FALSE(arm_->Paused());
  EXPECT_EQ(reason_of([&] { mine->Drive(0, 1, 20); }), "");
}

TEST_F(Control, AThousandTimes) {
  const auto descriptors = [&] {
    const std::filesystem::directory_iterator entries(fmt::format("/proc/{}/fd", servant_->pid()));
    return std::distance(begin(entries), end(entries));
  };
  const auto cycle = [&](int i) {
    Corbot::Arm_var mine = arm_->Acquire(fmt::format("client {}", i).c_str(), kLongLease_s);
    mine->Override(100.0);
    mine->Release();
  };
  constexpr int kCycles = 1000;
  for (int i = 0; i < kCycles / 4; ++i) cycle(i);
  const long warm_kb = servant_->anonymous_kb();
  const auto before = descriptors();
  for (int i = kCycles / 4; i < kCycles; ++i) cycle(i);
  EXPECT_EQ(descriptors(), before);
  const long grown_kb = servant_->anonymous_kb() - warm_kb;
  fmt::print("{} cycles: {} kB after a quarter of them, {} kB more at the end\n", kCycles, warm_kb, grown_kb);
  if (!CORBOT_SANITIZED) {  // a sanitizer keeps what is freed
    EXPECT_LT(grown_kb, 300) << "750 cycles that leave 512 bytes each";
  }
  EXPECT_EQ(holder(), "");
}

}  // namespace
}  // namespace corbot::test
