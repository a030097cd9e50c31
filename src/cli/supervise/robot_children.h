// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/supervise/supervisor.h"
#include "cli/supervise/up_options.h"
#include "client/local_robots.h"
#include "config/profile.h"

// The processes of a robot, as the supervisor starts them.

namespace corbot::cli {

inline constexpr const char* kNaming = "naming service";
inline constexpr const char* kRealTimeTask = "real-time task";
inline constexpr const char* kServant = "servant";
inline constexpr const char* kPanel = "panel";
inline constexpr const char* kOrbit2Servant = "corbot-servant-orbit2";

/// `log_directory` stores its names.
[[nodiscard]] Supervisor::Spec naming_service(int port, const std::string& log_directory);
/// `position` receives the task's report on the arm's position.
[[nodiscard]] Supervisor::Spec real_time_task(const UpOptions& options, const client::RobotState& state,
                                              const Profile& profile, std::string& position);
/// `state` receives the servant's address.
[[nodiscard]] Supervisor::Spec servant(const UpOptions& options, client::RobotState& state,
                                       const SupervisorOptions& times);
/// Returns the path of corbot-panel. Throws client::Failure if it is not installed.
[[nodiscard]] std::string panel_program();
/// A panel with these arguments, which name what it shows; each start reports its URLs.
[[nodiscard]] Supervisor::Spec panel(std::vector<std::string> shown, int port);

}  // namespace corbot::cli
