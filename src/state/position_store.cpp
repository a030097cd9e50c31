// SPDX-License-Identifier: Apache-2.0
#include "state/position_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <system_error>
#include <utility>

namespace corbot {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void throw_system(const fs::path& path, int error) {
  throw std::system_error(error, std::generic_category(), path.string());
}

/// A file descriptor, closed at the end.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

fs::path from_environment(const char* variable, const char* below) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value == '/' ? fs::path(value) / below : fs::path();
}

void write_all(int fd, const std::string& text, const fs::path& path) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = ::write(fd, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw_system(path, errno);
    done += static_cast<std::size_t>(n);
  }
  if (::fsync(fd) != 0) throw_system(path, errno);
}

bool is_name(const std::string& text) {
  return !text.empty() && text.size() <= 48 && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

}  // namespace

fs::path default_state_directory() {
  for (const auto& [variable, below] :
       {std::pair{"CORBOT_STATE_DIR", ""}, {"XDG_STATE_HOME", "corbot"}, {"HOME", ".local/state/corbot"}}) {
    if (fs::path found = from_environment(variable, below); !found.empty()) return found;
  }
  return {};
}

std::string boot_id() {
  const Descriptor file(::open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC));
  std::array<char, 36> text{};
  if (file.get() < 0 || ::read(file.get(), text.data(), text.size()) != ssize_t{text.size()}) return {};
  return {text.data(), text.size()};
}

LastPosition position_of(const Snapshot& snapshot, const std::string& robot) {
  LastPosition position;
  position.robot = robot;
  position.fingerprint = snapshot.position_fingerprint;
  position.boot_id = boot_id();
  position.saved_s = static_cast<std::int64_t>(std::time(nullptr));
  position.at_rest = snapshot.command_id == 0;
  position.held = (snapshot.flags & kSnapshotHeld) != 0;
  position.in_error = snapshot.state == RtState::kError;
  position.position_q = snapshot.position_q;
  position.opening = snapshot.gripper;
  return position;
}

PositionStore::PositionStore(const fs::path& directory, const std::string& robot, const std::string& writer)
    : file_(directory / (robot + ".position")),
      fresh_(directory / (robot + ".position." + writer)),
      robot_(robot) {
  if (!is_name(robot)) throw std::invalid_argument("'" + robot + "' is no name of a robot");
}

std::optional<LastPosition> PositionStore::load(const ArmModel& arm) const {
  // O_NONBLOCK: a pipe in its place must not hold the start up.
  const Descriptor file(::open(file_.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (file.get() < 0) {
    if (errno == ENOENT || errno == ENOTDIR) return std::nullopt;
    throw PositionError(file_.string() + ": " + std::strerror(errno));
  }
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) throw PositionError(file_.string() + ": " + std::strerror(errno));
  if (!S_ISREG(status.st_mode) || status.st_uid != ::geteuid() || (status.st_mode & 0022) != 0)
    throw PositionError(file_.string() + ": is not a file of yours that only you may write");
  std::string text(kMaxPositionBytes + 1, '\0');
  const ssize_t n = ::read(file.get(), text.data(), text.size());
  if (n < 0) throw PositionError(file_.string() + ": " + std::strerror(errno));
  text.resize(static_cast<std::size_t>(n));
  try {
    return parse_position(text, robot_, arm);
  } catch (const PositionError& error) {
    throw PositionError(file_.string() + ": " + error.what(), error.held(), error.in_error());
  }
}

void PositionStore::save(const LastPosition& position, std::size_t dof) const {
  const fs::path directory = file_.parent_path();
  std::error_code error;
  fs::create_directories(directory.parent_path(), error);  // the next call reports what is wrong
  if (::mkdir(directory.c_str(), 0700) != 0 && errno != EEXIST) throw_system(directory, errno);
  const Descriptor parent(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (parent.get() < 0) throw_system(directory, errno);
  try {
    const Descriptor fresh(
        ::open(fresh_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (fresh.get() < 0) throw_system(fresh_, errno);
    write_all(fresh.get(), position_text(position, dof), fresh_);
    if (::rename(fresh_.c_str(), file_.c_str()) != 0) throw_system(file_, errno);
  } catch (const std::system_error&) {
    ::unlink(fresh_.c_str());  // frees its bytes on a full disk
    throw;
  }
  if (::fsync(parent.get()) != 0) throw_system(directory, errno);
}

}  // namespace corbot
