// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <exception>
#include <memory>
#include <string>
#include <utility>

#include "config/arms/write_urdf.h"
#include "robot/call_error.h"
#include "robot/corbot_robot.h"
#include "robot/release_signal.h"
#include "robot/robot.h"

// The object behind the functions of corbot_robot.h, for their sources only.

struct corbot_robot {
  corbot_robot(corbot::Profile profile, std::string robot_name)
      : name(std::move(robot_name)),
        urdf(corbot::config::write_urdf(profile.arm, profile.name, profile.joint_names)),
        robot(std::move(profile), name) {}
  std::string name;
  const std::string urdf;
  const std::chrono::duration<double> started{std::chrono::system_clock::now().time_since_epoch()};
  corbot::Robot robot;
  std::unique_ptr<corbot::ReleaseSignal> release_signal{};  // its thread calls the robot
};

namespace corbot {

/// Runs `body` and turns a thrown exception into a status.
template <class Body>
corbot_status guarded(corbot_error* error, Body&& body) noexcept {
  corbot_error ignored{};
  corbot_error& out = error != nullptr ? *error : ignored;
  out = corbot_error{};
  out.joint = -1;
  try {
    body();
  } catch (const CallError& refused) {
    out = refused.error;
  } catch (const std::exception& exception) {
    out.status = CORBOT_INTERNAL;
    copy_text(exception.what(), out.text, sizeof(out.text));
  } catch (...) {
    out.status = CORBOT_INTERNAL;
    copy_text("unknown exception", out.text, sizeof(out.text));
  }
  return out.status;
}

}  // namespace corbot
