// SPDX-License-Identifier: Apache-2.0
#include "cli/state_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/failure.h"
#include "cli/segment_left_over.h"

namespace corbot::cli {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

Failure system_failure(const fs::path& path, int error) {
  return {ExitCode::kInternal, fmt::format("{}: {}", path.string(), std::strerror(error))};
}

/// The open lock file of a robot, or −1 with errno.
int open_lock(const fs::path& directory, const std::string& name, int flags) {
  return ::open((directory / (name + ".lock")).c_str(), flags | O_CLOEXEC | O_NOFOLLOW, 0600);
}

/// Is the open file still the one of that name?
bool is_linked(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && status.st_nlink > 0;
}

void remove_files(const fs::path& directory, const std::string& name) {
  std::error_code ignored;
  fs::remove(directory / (name + ".json"), ignored);
  fs::remove(directory / (name + ".lock"), ignored);
}

/// Names of the robots that have a state file, sorted: those that are up, or those that are not.
std::vector<std::string> robots_of_files(bool up) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(state_directory(false), error)) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() == ".json" && is_robot_name(name) && is_up(name) == up)
      names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

fs::path state_directory(bool create) {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  fs::path path = runtime != nullptr && *runtime == '/'
                      ? fs::path(runtime) / "corbot"
                      : fs::path(fmt::format("/tmp/corbot-{}", ::geteuid()));
  if (create && ::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) throw system_failure(path, errno);
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) {
    if (errno == ENOENT && !create) return path;
    throw system_failure(path, errno);
  }
  if (!S_ISDIR(status.st_mode) || status.st_uid != ::geteuid() || (status.st_mode & 0077) != 0) {
    throw Failure(
        ExitCode::kInternal,
        fmt::format("{} is not a directory of yours with mode 0700: somebody else may have put it there; "
                    "remove it, or set XDG_RUNTIME_DIR",
                    path.string()));
  }
  return path;
}

bool is_robot_name(const std::string& name) {
  return !name.empty() && name.size() <= 32 && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

std::optional<RobotState> read_state(const std::string& name) {
  if (!is_robot_name(name)) return std::nullopt;
  std::ifstream stream(state_directory(false) / (name + ".json"));
  if (!stream) return std::nullopt;
  const json data = json::parse(stream, nullptr, false);
  if (!data.is_object()) return std::nullopt;
  RobotState state;
  try {
    state.name = data.at("name").get<std::string>();
    state.pid = data.at("pid").get<pid_t>();
    state.profile = data.value("profile", "");
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
  if (!is_robot_name(name)) return false;
  const int fd = open_lock(state_directory(false), name, O_RDONLY);
  if (fd < 0) return false;
  const bool free = ::flock(fd, LOCK_SH | LOCK_NB) == 0;
  ::close(fd);
  return !free;
}

std::vector<std::string> robots_up() { return robots_of_files(true); }

StateLock::StateLock(fs::path directory, std::string name, int fd)
    : directory_(std::move(directory)), name_(std::move(name)), fd_(fd) {}

StateLock::StateLock(StateLock&& other) noexcept
    : directory_(std::move(other.directory_)),
      name_(std::move(other.name_)),
      fd_(std::exchange(other.fd_, -1)) {}

StateLock::~StateLock() {
  if (fd_ < 0) return;
  remove_files(directory_, name_);  // before the lock is released, so that a successor's files are not hit
  ::close(fd_);
}

std::optional<StateLock> StateLock::acquire(const std::string& name) {
  const fs::path directory = state_directory(true);
  // A reader that tests the lock holds it for an instant; so one refusal is not yet proof of another
  // supervisor.
  for (int attempt = 0; attempt < 20; ++attempt) {
    const int fd = open_lock(directory, name, O_RDWR | O_CREAT);
    if (fd < 0) throw system_failure(directory / (name + ".lock"), errno);
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0) {
      if (is_linked(fd)) return StateLock(directory, name, fd);
    } else {
      ::usleep(5000);
    }
    ::close(fd);
  }
  return std::nullopt;
}

void StateLock::write(const RobotState& state) const {
  const json data{{"name", state.name},       {"pid", state.pid},
                  {"profile", state.profile}, {"endpoint", state.endpoint},
                  {"address", state.address}, {"orb", state.orb},
                  {"rt_pid", state.rt_pid},   {"servant_pid", state.servant_pid},
                  {"naming", state.naming}};
  const std::string text = data.dump(2) + "\n";
  const fs::path file = directory_ / (name_ + ".json");
  const fs::path fresh = directory_ / (name_ + ".json.new");
  const int fd = ::open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) throw system_failure(fresh, errno);
  const bool whole = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int error = errno;
  ::close(fd);
  if (!whole) throw system_failure(fresh, error);
  if (::rename(fresh.c_str(), file.c_str()) != 0) throw system_failure(file, errno);
}

std::vector<std::string> left_overs() {
  std::vector<std::string> names = robots_of_files(false);
  for (const std::string& name : abandoned_segments()) {
    if (is_robot_name(name) && !is_up(name)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

bool remove_left_overs(const std::string& name) {
  const auto lock = StateLock::acquire(name);  // its end removes the files
  if (!lock) return false;
  const bool had_state = read_state(name).has_value();
  const bool had_segment = remove_abandoned_segment(name);
  return had_state || had_segment;
}

}  // namespace corbot::cli
