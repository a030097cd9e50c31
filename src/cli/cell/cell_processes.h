// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cell/program.h"
#include "cli/supervise/panel_port.h"
#include "cli/supervise/supervisor.h"

// The processes of a cell, as the supervisor starts them.

namespace corbot::cli {

inline constexpr const char* kScene = "scene";
inline constexpr const char* kCoordinator = "coordinator";
/// Subdirectory of the state directory for profiles and states of the robots that the cell starts.
inline constexpr const char* kRobots = "robots";

/// Returns the log file of the program with this title.
[[nodiscard]] std::filesystem::path log_file(const cell::CellConfig& cell, const std::string& title);
/// Returns the file to which the scene writes its last line.
[[nodiscard]] std::filesystem::path scene_output(const cell::CellConfig& cell);

/// Throws Failure: kInternal if a port that the cell needs is in use, kUsage if a program is not installed.
void check_installation(const cell::CellConfig& cell, PanelPort panel);
/// Returns a robot's profile as the cell uses it, with SCENE and NAME of its port replaced. Throws Failure
/// and ConfigError.
[[nodiscard]] std::string profile_text(const cell::CellConfig& cell, const cell::CellRobot& robot);
/// Writes each of these profiles to the state directory.
void write_profiles(const cell::CellConfig& cell);
/// Whether the coordinator waits for Start or begins at once.
enum class Begin { kAtStart, kAtOnce };

/// Returns the processes in the order of their start, the coordinator last: its arms rest before the others
/// end. The panel finds the cell by its published addresses. Calls `on_event` with each line that the
/// coordinator prints.
[[nodiscard]] std::vector<Supervisor::Spec> cell_processes(const cell::CellConfig& cell,
                                                           const cell::CellOptions& options, Begin begin,
                                                           PanelPort panel,
                                                           std::function<void(const std::string&)> on_event);

}  // namespace corbot::cli
