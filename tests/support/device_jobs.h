// SPDX-License-Identifier: Apache-2.0
// The motions that every kind of device is tested with.
#pragma once

#include <arm.hh>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "support/paths.h"

namespace corbot::test {

/// The profile of the Lynx 5, its backend replaced.
inline void write_lynx5_profile(const std::string& file, const std::string& backend) {
  std::ifstream from(CORBOT_TEST_PROFILE);
  std::stringstream text;
  text << from.rdbuf();
  const std::string all = text.str();
  std::ofstream(file) << all.substr(0, all.find("[backend]")) << backend;
}

/// The paper's pick and place with one arm, an arc and Ready. `expect_arrived` is called after every motion,
/// `expect_closed` with the gripper closed.
inline void pick_and_place(Corbot::Arm_ptr arm, const std::function<void()>& expect_arrived,
                           const std::function<void()>& expect_closed) {
  arm->Open();
  for (const double above_m : {0.06, 0.0, 0.06}) {
    arm->MoveS(0.22, -0.08, 0.02, above_m, 0.0);
    expect_arrived();
    if (above_m == 0.0) arm->Close();
  }
  expect_closed();
  arm->Move(0.20, 0.10, 0.02, 0.06, 1.0);
  arm->MoveS(0.20, 0.10, 0.02, 0.0, 0.0);
  expect_arrived();
  arm->Open();
  arm->MoveC({0.20, 0.10, 0.08}, {0.24, 0.0, 0.12}, {0.22, -0.08, 0.08});
  expect_arrived();
  arm->Ready();
  expect_arrived();
}

}  // namespace corbot::test
