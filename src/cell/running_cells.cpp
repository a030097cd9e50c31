// SPDX-License-Identifier: Apache-2.0
#include "cell/running_cells.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "shm/descriptor.h"
#include "state/position_store.h"

namespace corbot::cell {

using client::ExitCode;
using client::Failure;

namespace fs = std::filesystem;

namespace {

fs::path cells_directory() { return default_state_directory() / "cells"; }

CellConfig load_running(const fs::path& directory) {
  std::ifstream file(directory / kAddresses);
  const nlohmann::json found = nlohmann::json::parse(file, nullptr, false);
  if (!holder_of(directory) || !found.is_object())
    throw Failure(ExitCode::kUnreachable,
                  fmt::format("no cell runs in {}: 'corbot cell up CELL' starts one", directory.string()));
  try {
    CellOverrides overrides;
    overrides.name = found.at("name").get<std::string>();
    overrides.ports = found.at("ports").get<int>();
    overrides.state_directory = directory;
    return load_cell(found.at("file").get<std::string>(), overrides);
  } catch (const nlohmann::json::exception&) {
    throw Failure(ExitCode::kInternal,
                  fmt::format("{}: is of another version of corbot: start that cell again",
                              (directory / kAddresses).string()));
  }
}

}  // namespace

std::optional<pid_t> holder_of(const fs::path& directory) {
  const Descriptor fd(::open((directory / kLock).c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.get() < 0 || ::flock(fd.get(), LOCK_SH | LOCK_NB) == 0) return std::nullopt;
  std::ifstream stream(directory / kLock);
  pid_t pid = 0;
  return stream >> pid && pid > 1 ? std::optional(pid) : std::nullopt;
}

void publish_addresses(const CellConfig& cell, const fs::path& file) {
  nlohmann::json robots = nlohmann::json::object();
  for (const CellRobot& robot : cell.robots) robots[robot.name] = cell.robot_uri(robot);
  const nlohmann::json addresses{{"name", cell.name},
                                 {"file", fs::absolute(file).lexically_normal().string()},
                                 {"ports", cell.ports},
                                 {"store", cell.store_uri()},
                                 {"camera", cell.camera_uri()},
                                 {"coordinator", cell.coordinator_uri()},
                                 {"robots", robots}};
  const fs::path path = cell.state_directory / kAddresses;
  const fs::path unfinished = path.string() + ".new";
  std::error_code refused;
  if (std::ofstream stream(unfinished); (stream << addresses.dump() << '\n').flush())
    fs::rename(unfinished, path, refused);
  else
    refused = std::error_code(errno != 0 ? errno : EIO, std::system_category());
  if (refused) throw client::system_failure(path.string() + ": cannot be written", refused.value());
}

std::vector<fs::path> running_cells() {
  std::vector<fs::path> running;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(cells_directory(), none)) {
    if (holder_of(entry.path()) && fs::exists(entry.path() / kAddresses)) running.push_back(entry.path());
  }
  std::sort(running.begin(), running.end());
  return running;
}

CellConfig find_cell(const std::string& word) {
  if (fs::is_directory(word)) return load_running(fs::absolute(word).lexically_normal());
  if (fs::exists(word) || word.find('/') != std::string::npos) return load_cell(word);
  return load_running(cells_directory() / word);
}

}  // namespace corbot::cell
