// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "support/device_jobs.h"
#include "support/emulated_controller.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {

/// A robot on an emulated serial controller.
class SerialRobot : public RobotRig {
 protected:
  /// Every derived fixture begins with plug_in().
  void SetUp() override {}
  void TearDown() override {
    RobotRig::TearDown();
    if (controller_) {
      EXPECT_EQ(controller_->stop(), 0);
    }
    std::filesystem::remove_all(directory_);
  }

  /// Starts the controller, and writes the profile. `backend`: its kind in the profile; `options`: more keys
  /// of its table.
  void plug_in(const std::vector<std::string>& controller, const std::string& backend,
               const std::string& options = "") {
    take_name("serial");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    std::filesystem::create_directory(directory_);
    controller_.emplace(std::string(CORBOT_BIN_DIR) + "/corbot-sim", controller, directory_);
    controller_->start();
    profile_ = directory_ + "/arm.toml";
    write_lynx5_profile(
        profile_,
        fmt::format("[backend]\nkind = \"{0}\"\nposition_known_at_start = true\n[backend.{0}]\nport = "
                    "\"{1}\"\n{2}",
                    backend, controller_->line(), options));
  }

  std::string directory_;
  std::optional<EmulatedController> controller_;
};

}  // namespace corbot::test
