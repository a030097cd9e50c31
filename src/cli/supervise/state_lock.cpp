// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/state_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "client/failure.h"
#include "config/profile.h"
#include "shm/descriptor.h"
#include "shm/run_directory.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::is_up;
using client::open_lock;
using client::read_state;
using client::robots_with_stale_state;
using client::RobotState;
using client::state_directory;
using client::system_failure;

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// Returns true if the open file still has a name.
bool is_linked(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && status.st_nlink > 0;
}

bool is_same_file(int fd, const fs::path& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(fd, &opened) == 0 && ::lstat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

/// Takes both locks of an open lock file. The record lock gives this process's pid to supervisor_of(). The
/// kernel drops it when the process closes any descriptor of the file, so the process closes only descriptors
/// of a refused lock.
bool take(int fd) {
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) return false;
  struct flock record {};
  record.l_type = F_WRLCK;
  record.l_whence = SEEK_SET;
  return ::fcntl(fd, F_SETLK, &record) == 0;
}

void rewrite(const fs::path& file, const std::string& text) {
  const fs::path fresh = file.string() + ".new";
  const Descriptor fd(::open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (fd.get() < 0) throw system_failure(fresh, errno);
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t n = ::write(fd.get(), text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw system_failure(fresh, errno);
    done += static_cast<std::size_t>(n);
  }
  if (::rename(fresh.c_str(), file.c_str()) != 0) throw system_failure(file, errno);
}

void remove_files(const fs::path& directory, const std::string& name) {
  std::error_code ignored;
  for (const char* suffix : {".json", ".notify", ".toml"}) fs::remove(directory / (name + suffix), ignored);
  fs::remove(directory / (name + ".lock"), ignored);
}

}  // namespace

StateLock::StateLock(fs::path directory, std::string name, int fd)
    : directory_(std::move(directory)), name_(std::move(name)), fd_(fd) {}

StateLock::StateLock(StateLock&& other) noexcept
    : directory_(std::move(other.directory_)),
      name_(std::move(other.name_)),
      fd_(std::exchange(other.fd_, -1)),
      state_(std::move(other.state_)),
      profile_(std::move(other.profile_)) {}

StateLock::~StateLock() {
  if (fd_ < 0) return;
  // Precedes the release of the lock, so that a successor's files stay. If the lock's own file is gone or
  // replaced, all other files may be replaced, too.
  if (is_same_file(fd_, directory_ / (name_ + ".lock"))) remove_files(directory_, name_);
  ::close(fd_);
}

std::optional<StateLock> StateLock::acquire(const std::string& name) {
  const fs::path directory = state_directory(true);
  // A reader that tests the lock holds it for an instant, so one refusal does not prove another supervisor.
  for (int attempt = 0; attempt < 20; ++attempt) {
    const int fd = open_lock(directory, name, O_RDWR | O_CREAT);
    if (fd < 0) throw system_failure(directory / (name + ".lock"), errno);
    if (take(fd)) {
      if (is_linked(fd)) return StateLock(directory, name, fd);
    } else {
      ::usleep(5000);
    }
    ::close(fd);
  }
  return std::nullopt;
}

void StateLock::write(const RobotState& state) {
  const json data{{"name", state.name},       {"pid", state.pid},
                  {"profile", state.profile}, {"endpoint", state.endpoint},
                  {"address", state.address}, {"orb", state.orb},
                  {"rt_pid", state.rt_pid},   {"servant_pid", state.servant_pid},
                  {"naming", state.naming}};
  state_ = data.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
  rewrite(directory_ / (name_ + ".json"), state_);
}

void StateLock::write_profile(std::string text) {
  profile_ = std::move(text);
  rewrite(profile_path(), profile_);
}

void StateLock::restore() {
  std::error_code ignored;
  if (!is_same_file(fd_, directory_ / (name_ + ".lock"))) {
    (void)state_directory(true);
    const int fd = open_lock(directory_, name_, O_RDWR | O_CREAT);
    if (fd < 0) throw system_failure(directory_ / (name_ + ".lock"), errno);
    if (!take(fd)) {
      ::close(fd);
      throw Failure(ExitCode::kInternal,
                    fmt::format("another 'corbot up' has the lock of '{}': end that one first", name_));
    }
    ::close(std::exchange(fd_, fd));
  }
  if (!profile_.empty() && !fs::exists(profile_path(), ignored)) rewrite(profile_path(), profile_);
  const fs::path state = directory_ / (name_ + ".json");
  if (!state_.empty() && !fs::exists(state, ignored)) rewrite(state, state_);
}

std::vector<std::string> stale_robots() {
  std::vector<std::string> names = robots_with_stale_state();
  for (const std::string& name : sockets_left_behind()) {
    if (is_name(name) && !is_up(name)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

bool remove_stale(const std::string& name) {
  const auto lock = StateLock::acquire(name);  // its destructor removes the files
  if (!lock) return false;
  const bool had_state = read_state(name).has_value();
  const bool had_socket = remove_left_behind(name);
  return had_state || had_socket;
}

}  // namespace corbot::cli
