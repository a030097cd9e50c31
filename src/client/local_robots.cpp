// SPDX-License-Identifier: Apache-2.0
#include "client/local_robots.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "config/profile.h"
#include "shm/run_directory.h"

namespace corbot::client {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// Names of the robots that have a state file, sorted: those that are up, or those that are not.
std::vector<std::string> robots_of_files(bool up) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(state_directory(false), error)) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() == ".json" && is_name(name) && is_up(name) == up) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

fs::path state_directory(bool create) {
  try {
    (void)open_user_run_directory(create);
  } catch (const SegmentError& error) {
    throw Failure(ExitCode::kInternal, error.what());
  }
  return user_run_directory();
}

int open_lock(const fs::path& directory, const std::string& name, int flags) {
  return ::open((directory / (name + ".lock")).c_str(), flags | O_CLOEXEC | O_NOFOLLOW, 0600);
}

std::optional<RobotState> read_state(const std::string& name) {
  if (!is_name(name)) return std::nullopt;
  std::ifstream stream(state_directory(false) / (name + ".json"));
  if (!stream) return std::nullopt;
  const json data = json::parse(stream, nullptr, false);
  if (!data.is_object()) return std::nullopt;
  RobotState state;
  try {
    state.name = data.at("name").get<std::string>();
    state.pid = data.at("pid").get<pid_t>();
    state.profile = data.value("profile", "");
    state.profile_in_use = (state_directory(false) / (name + ".toml")).string();
    state.endpoint = data.value("endpoint", "");
    state.address = data.value("address", "");
    state.orb = data.value("orb", "");
    state.rt_pid = data.value("rt_pid", 0);
    state.servant_pid = data.value("servant_pid", 0);
    state.naming = data.value("naming", "");
  } catch (const json::exception&) {
    return std::nullopt;
  }
  return state;
}

bool is_up(const std::string& name) {
  if (!is_name(name)) return false;
  const int fd = open_lock(state_directory(false), name, O_RDONLY);
  if (fd < 0) return false;
  const bool free = ::flock(fd, LOCK_SH | LOCK_NB) == 0;
  ::close(fd);
  return !free;
}

std::vector<std::string> robots_up() { return robots_of_files(true); }

std::vector<std::string> robots_with_stale_state() { return robots_of_files(false); }

}  // namespace corbot::client
