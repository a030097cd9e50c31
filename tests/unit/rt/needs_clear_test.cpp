// SPDX-License-Identifier: Apache-2.0
// Every cause of Error: its end clears nothing, nothing is energised and nothing moves before a Clear, and
// nothing moves by itself after it.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "rt/bad_line.h"
#include "rt/fault_fixture.h"

namespace corbot::test::needs_clear_test {
namespace {

struct Scene {
  Rig& rig;
  FakeDevice& device;
  bool is_watched{false};  ///< by a thread that looks in every cycle
};

struct Cause {
  std::string name;
  AlarmCode alarm;
  std::function<void(Scene&)> comes;
  std::function<void(Scene&)> goes;
  bool takes_energy{true};
  bool by_line{false};  ///< what runs is a BadLine
};

void nothing(Scene&) {}

Cause press(const std::string& name, StopSource source) {
  return {name, AlarmCode::kEmergencyStop,
          [source](Scene& scene) { scene.rig.emergency_stop->set(source, true); },
          [source](Scene& scene) { scene.rig.emergency_stop->set(source, false); }};
}

std::vector<Cause> causes() {
  return {
      press("line", StopSource::kGpio),
      press("line_unheard", StopSource::kGpioUnheard),
      press("device_input", StopSource::kDevice),
      press("device_input_unheard", StopSource::kDeviceUnheard),
      press("watchdog_output", StopSource::kWatchdog),
      {"watcher", AlarmCode::kEmergencyStop,
       [](Scene& scene) {
         scene.rig.emergency_stop->beat();
         scene.rig.step(102);
       },
       [](Scene& scene) { scene.is_watched = true; }},
      {"lost_device", AlarmCode::kBackendLost, [](Scene& scene) { scene.device.now = BackendHealth::kLost; },
       [](Scene& scene) { scene.device.now = BackendHealth::kStandby; }},
      {"torque_off", AlarmCode::kBackendLost,
       [](Scene& scene) {
         scene.device.now = BackendHealth::kStandby;
         scene.device.why = DeviceCause::kTorqueOff;
       },
       nothing},
      {"following_error", AlarmCode::kFollowingError, [](Scene& scene) { scene.device.lag_q[1] = 1.0; },
       [](Scene& scene) { scene.device.lag_q = {}; }},
      {"goal", AlarmCode::kGoalNotReached, [](Scene& scene) { scene.device.lag_q[1] = 0.1; },
       [](Scene& scene) { scene.device.lag_q = {}; }},
      {"gap", AlarmCode::kLoopGap, [](Scene& scene) { scene.rig.now_ns += 500'000'000; }, nothing},
      {"bad_path", AlarmCode::kSetPointNotFinite, nothing, nothing, true, true},
      {"inherited", AlarmCode::kErrorInherited,
       [](Scene& scene) {
         scene.rig.task->stop_seen = 1;
         scene.rig.restart();
       },
       nothing},
      {"replaced_task", AlarmCode::kTaskReplaced,
       [](Scene& scene) { scene.rig.restart({.after_gap = true}); }, nothing},
      {"hold", AlarmCode::kHeld,
       [](Scene& scene) {
         scene.rig.servant->control.hold_count.fetch_add(1);
         scene.rig.stop();
       },
       nothing, false},
  };
}

class NeedsClear : public FaultStops, public ::testing::WithParamInterface<Cause> {
 protected:
  NeedsClear() {
    for (std::size_t i = 0; i < kMaxJoints; ++i) rig.settings.following[i] = {0.2, 20'000'000, 0.02};
    rig.settings.settle_ns = 100'000'000;
    device.measures = true;
    device.stands_by = true;
  }
  [[nodiscard]] bool is_expected(AlarmCode code) const {
    if (GetParam().by_line)
      return code >= AlarmCode::kSetPointNotFinite && code <= AlarmCode::kKinematicsFailed;
    return code == GetParam().alarm;
  }
  void step() {
    if (scene.is_watched) rig.emergency_stop->beat();
    rig.step();
  }
  /// For a while: nothing changes, whatever is asked for.
  void expect_nothing_moves(RtState state) {
    const Joints there = rig.snapshot.position_q;
    for (int i = 0; i < 300; ++i) {
      step();
      ASSERT_EQ(rig.snapshot.state, state) << i;
      ASSERT_EQ(device.frame.needs_clear, state == RtState::kError) << i;
      ASSERT_EQ(device.frame.power_off, state == RtState::kError && GetParam().takes_energy) << i;
      ASSERT_EQ(rig.snapshot.position_q, there) << i;
      ASSERT_EQ(device.frame.position_q, there) << i;
    }
  }
  Scene scene{rig, device};
};

TEST_P(NeedsClear, AndNothingElseWillDo) {
  const Cause& cause = GetParam();
  if (cause.by_line) {
    BadLine().begin(rig);
  } else {
    begin_anew({.position_known = true});
    go();
  }
  rig.step(100);
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  cause.comes(scene);
  for (int i = 0; i < kLongestStop && rig.snapshot.state != RtState::kError; ++i) rig.step();
  ASSERT_EQ(rig.snapshot.state, RtState::kError);
  until_rest();
  std::vector<AlarmCode> alarms;
  while (const auto alarm = rig.alarm()) alarms.push_back(alarm->code);
  ASSERT_FALSE(alarms.empty());
  EXPECT_TRUE(is_expected(alarms.front())) << static_cast<int>(alarms.front());
  while (rig.completion()) {
  }

  cause.goes(scene);
  for (int i = 0; i < 3; ++i) step();
  expect_nothing_moves(RtState::kError);
  go({0.1, 0.1, 0.1, 0.1});
  rig.step(2);
  const auto refused = rig.completion();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->verdict, Verdict::kFault);
  expect_nothing_moves(RtState::kError);
  EXPECT_EQ(device.now, cause.takes_energy ? BackendHealth::kStandby : BackendHealth::kOpen);

  clear();
  ASSERT_EQ(rig.snapshot.state, cause.takes_energy ? RtState::kMoving : RtState::kStandby);
  device.now = BackendHealth::kOpen;
  rig.step(2);
  expect_nothing_moves(RtState::kStandby);
}

INSTANTIATE_TEST_SUITE_P(Causes, NeedsClear, ::testing::ValuesIn(causes()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test::needs_clear_test
