// SPDX-License-Identifier: Apache-2.0
#include "client/local_robots.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "config/profile.h"
#include "config/similar.h"
#include "net/ports.h"
#include "shm/run_directory.h"

namespace corbot::client {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

bool is_up_in(const fs::path& directory, const std::string& name) {
  if (!is_name(name)) return false;
  const int fd = open_lock(directory, name, O_RDONLY);
  if (fd < 0) return false;
  const bool free = ::flock(fd, LOCK_SH | LOCK_NB) == 0;
  ::close(fd);
  return !free;
}

/// Returns the names of the robots that have a state file there, sorted: those that are up, or those that are
/// not.
std::vector<std::string> robots_of_files(const fs::path& directory, bool up) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() == ".json" && is_name(name) && is_up_in(directory, name) == up)
      names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::optional<RobotState> read_state_in(const fs::path& directory, const std::string& name) {
  if (!is_name(name)) return std::nullopt;
  std::ifstream stream(directory / (name + ".json"));
  if (!stream) return std::nullopt;
  const json data = json::parse(stream, nullptr, false);
  if (!data.is_object()) return std::nullopt;
  RobotState state;
  try {
    state.name = data.at("name").get<std::string>();
    state.pid = data.at("pid").get<pid_t>();
    state.profile = data.value("profile", "");
    state.profile_in_use = (directory / (name + ".toml")).string();
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
  return read_state_in(state_directory(false), name);
}

std::string robots_elsewhere(const std::string& name, const std::string& naming) {
  std::string text;
  for (const std::string& other : other_user_run_directories()) {
    if (!is_user_run_directory(other)) continue;
    for (const std::string& robot : robots_of_files(other, true)) {
      const auto state = name.empty() || robot == name ? read_state_in(other, robot) : std::nullopt;
      if (!state || state->address.empty()) continue;
      text += fmt::format("{}'{}' is up with its files in {}, that is, with another XDG_RUNTIME_DIR: {} {}",
                          text.empty() ? "" : "; ", robot, other, naming, state->address);
    }
  }
  return text;
}

std::string where_looked(const std::string& name, const std::string& naming) {
  const std::string elsewhere = robots_elsewhere(name, naming);
  return fmt::format("looked in {}{}{}", user_run_directory(), elsewhere.empty() ? "" : "; ", elsewhere);
}

bool is_up(const std::string& name) { return is_up_in(state_directory(false), name); }

std::optional<pid_t> supervisor_of(const std::string& name) {
  if (!is_name(name)) return std::nullopt;
  const int fd = open_lock(state_directory(false), name, O_RDWR);
  if (fd < 0) return std::nullopt;
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  const bool known = ::fcntl(fd, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK && lock.l_pid > 0;
  ::close(fd);
  if (!known) return std::nullopt;
  return lock.l_pid;
}

std::vector<std::string> robots_up() { return robots_of_files(state_directory(false), true); }

std::string robots_up_instead(const std::string& name) {
  const std::vector<std::string> up = robots_up();
  if (up.empty()) return "";
  const std::vector<std::string_view> known(up.begin(), up.end());
  const std::string_view near = most_similar(name, known, kSimilarKey);
  return fmt::format("; these are up: {}{}", fmt::join(up, ", "),
                     near.empty() ? "" : fmt::format("; did you mean '{}'?", near));
}

std::string robot_at_port(int port) {
  for (const std::string& robot : robots_up()) {
    const auto state = read_state(robot);
    if (state && state->endpoint.ends_with(fmt::format(":{}", port)))
      return fmt::format("'{}' is up at {}", robot, state->endpoint);
  }
  return "";
}

std::string robot_at(std::string where) {
  constexpr std::string_view kLocal = "localhost:";
  if (where.starts_with(kLocal)) where.replace(0, kLocal.size(), "127.0.0.1:");
  try {
    for (const std::string& robot : robots_up()) {
      const auto state = read_state(robot);
      if (state && state->endpoint == where) return robot;
    }
  } catch (const Failure&) {
    // The result serves only a message.
  }
  return "";
}

std::string endpoint_fault(const std::string& host, int port) {
  std::string why = net::listen_error(host, port);
  // Only then look for the robot: reading a robot's lock file releases the caller's own record lock of that
  // file.
  if (why.find("in use") == std::string::npos) return why;
  const std::string robot = robot_at_port(port);
  return robot.empty() ? why : fmt::format("port {} is taken: {}", port, robot);
}

std::vector<std::string> robots_with_stale_state() { return robots_of_files(state_directory(false), false); }

}  // namespace corbot::client
