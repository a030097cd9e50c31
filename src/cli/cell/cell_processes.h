// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cell/program.h"
#include "cli/supervise/supervisor.h"

// The processes of a cell, as the supervisor starts them.

namespace corbot::cli {

inline constexpr const char* kScene = "scene";
inline constexpr const char* kCoordinator = "coordinator";
/// Below the state directory: profiles and states of the robots that the cell starts.
inline constexpr const char* kRobots = "robots";
/// There, too: where the cell's programs and robots are served.
inline constexpr const char* kAddresses = "cell.json";

/// Where the program of this title logs.
[[nodiscard]] std::filesystem::path log_file(const cell::CellConfig& cell, const std::string& title);
/// Where the scene writes its last line.
[[nodiscard]] std::filesystem::path scene_output(const cell::CellConfig& cell);

/// Throws Failure, kInternal, where a port that the cell needs is taken, or kUsage where a program is not installed.
void check_installation(const cell::CellConfig& cell);
/// A robot's profile as the cell uses it, with SCENE and NAME of its port replaced. Throws Failure and ConfigError.
[[nodiscard]] std::string profile_text(const cell::CellConfig& cell, const cell::CellRobot& robot);
/// Writes each of them into the state directory.
void write_profiles(const cell::CellConfig& cell);
/// Writes kAddresses, by which clients find a cell that runs: one whose directory is locked. Throws Failure.
void publish_addresses(const cell::CellConfig& cell);
/// Whether the coordinator waits for Start.
enum class Begin { kAtStart, kAtOnce };

/// In the order of their start, the coordinator last. `on_event` is called for each line that the coordinator prints.
[[nodiscard]] std::vector<Supervisor::Spec> cell_processes(const cell::CellConfig& cell,
                                                           const cell::CellOptions& options, Begin begin,
                                                           std::function<void(const std::string&)> on_event);

}  // namespace corbot::cli
