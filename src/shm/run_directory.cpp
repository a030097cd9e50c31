// SPDX-License-Identifier: Apache-2.0
#include "shm/run_directory.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "shm/segment.h"

namespace corbot {
namespace {

using Kind = SegmentError::Kind;

constexpr const char* kLock = ".lock";  // no robot's name is empty
constexpr int kBacklog = 64;

[[noreturn]] void throw_system(const std::string& path, const char* what, int error) {
  const bool forbidden = error == EACCES || error == EPERM;
  throw SegmentError(forbidden ? Kind::kPermission : Kind::kSystem,
                     path + ": " + what + ": " + std::strerror(error) +
                         (forbidden ? ": run as the user who started the robot" : ""));
}

[[noreturn]] void throw_shared(const std::string& path) {
  throw SegmentError(Kind::kPermission,
                     path +
                         " is not a directory of yours with mode 0700: another user may have created it; "
                         "remove it, or set XDG_RUNTIME_DIR");
}

Descriptor make_socket(const std::string& path) {
  Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket) throw_system(path, "socket", errno);
  return socket;
}

/// Returns the address through the directory's descriptor. It is short for any length of the path, and
/// certainly in that directory.
sockaddr_un address_in(const Descriptor& directory, std::string_view robot) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::string path = "/proc/self/fd/" + std::to_string(directory.get()) + "/" + std::string(robot);
  path += ".sock";
  std::memcpy(address.sun_path, path.c_str(), std::min(path.size(), sizeof(address.sun_path) - 1));
  return address;
}

/// Returns none if there is no directory, unless `create`.
Descriptor open_directory(const std::string& path, bool create) {
  if (create && ::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) throw_system(path, "mkdir", errno);
  Descriptor fd(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (!fd && (errno != ENOENT || create)) {
    if (errno == ENOTDIR || errno == ELOOP) throw_shared(path);
    throw_system(path, "open", errno);
  }
  return fd;
}

struct stat status_of(const Descriptor& fd, const std::string& path) {
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) throw_system(path, "fstat", errno);
  return status;
}

bool is_private(const struct stat& status) {
  return status.st_uid == ::geteuid() && (status.st_mode & 0077) == 0;
}

pid_t peer_pid(const Descriptor& connection) {
  ucred peer{};
  socklen_t size = sizeof(peer);
  ::getsockopt(connection.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size);
  return peer.pid;
}

}  // namespace

std::string user_run_directory() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  return runtime != nullptr && *runtime == '/' ? std::string(runtime) + "/corbot"
                                               : "/tmp/corbot-" + std::to_string(::geteuid());
}

std::vector<std::string> other_user_run_directories() {
  const std::string user = std::to_string(::geteuid());
  std::vector<std::string> others{"/run/user/" + user + "/corbot", "/tmp/corbot-" + user};
  std::erase(others, user_run_directory());
  return others;
}

bool is_user_run_directory(const std::string& path) noexcept {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && is_private(status);
}

Descriptor open_user_run_directory(bool create) {
  const std::string path = user_run_directory();
  Descriptor fd = open_directory(path, create);
  if (fd && !is_private(status_of(fd, path))) throw_shared(path);
  return fd;
}

std::optional<RunDirectory> RunDirectory::open(bool create) {
  const char* const chosen = std::getenv("CORBOT_RUN_DIR");
  const bool is_chosen = chosen != nullptr && *chosen == '/';
  const std::string path = is_chosen ? std::string(chosen) : user_run_directory();
  Descriptor fd = is_chosen ? open_directory(path, create) : open_user_run_directory(create);
  if (!fd) return std::nullopt;
  const struct stat status = status_of(fd, path);
  // A directory set by CORBOT_RUN_DIR may belong to another user and be open to a group.
  if (is_chosen && (status.st_mode & 0022) != 0) throw_shared(path);
  return RunDirectory(path, std::move(fd), status.st_uid);
}

std::string RunDirectory::socket_path(std::string_view robot) const {
  return path_ + "/" + std::string(robot) + kSocket;
}

bool RunDirectory::is_trusted(uid_t peer) const noexcept { return peer == owner_ || peer == ::geteuid(); }

RunDirectory::Gate::Gate(const RunDirectory& directory) : directory_(directory) {
  constexpr timespec kPause{0, 1'000'000};
  for (int attempt = 0; !try_lock(); ++attempt) {
    if (attempt >= 2000) {
      const std::string path = directory.path_ + "/" + kLock;
      std::string text =
          path + ": another process has been starting or ending a task there for two seconds; see ";
      text += "which with 'lsof " + path + "'";
      throw SegmentError(Kind::kInUse, text);
    }
    ::nanosleep(&kPause, nullptr);
  }
}

/// Returns false also if the previous holder removed the file meanwhile: it is then no lock any more.
bool RunDirectory::Gate::try_lock() {
  lock_ = Descriptor(
      ::openat(directory_.fd_.get(), kLock, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0600));
  if (!lock_) throw_system(directory_.path_ + "/" + kLock, "open", errno);
  // A file that root created in another user's directory would exclude that user.
  if (::geteuid() == 0) (void)!::fchown(lock_.get(), directory_.owner_, static_cast<gid_t>(-1));
  struct stat locked {};
  struct stat named {};
  return ::flock(lock_.get(), LOCK_EX | LOCK_NB) == 0 && ::fstat(lock_.get(), &locked) == 0 &&
         ::fstatat(directory_.fd_.get(), kLock, &named, AT_SYMLINK_NOFOLLOW) == 0 &&
         locked.st_dev == named.st_dev && locked.st_ino == named.st_ino;
}

RunDirectory::Gate::~Gate() { ::unlinkat(directory_.fd_.get(), kLock, 0); }

RunDirectory::State RunDirectory::probe(std::string_view robot, Descriptor& connection) const {
  const std::string path = socket_path(robot);
  const std::string file = std::string(robot) + kSocket;
  struct stat status {};
  if (::fstatat(fd_.get(), file.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0) {
    if (errno == ENOENT) return State::kNone;
    throw_system(path, "stat", errno);
  }
  if (!S_ISSOCK(status.st_mode))
    throw SegmentError(Kind::kForeign, path + ": is no socket of corbot's; remove it");
  connection = make_socket(path);
  const sockaddr_un address = address_in(fd_, robot);
  if (::connect(connection.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0)
    return State::kListening;
  if (errno == EAGAIN) throw SegmentError(Kind::kSilent, path + ": the real-time task does not answer");
  if (errno == ENOENT) return State::kNone;
  if (errno == ECONNREFUSED) return State::kLeftBehind;
  throw_system(path, "connect", errno);
}

RunDirectory::Listening RunDirectory::listen(std::string_view robot, std::optional<gid_t> group) const {
  check_robot_name(robot);
  const std::string path = socket_path(robot);
  const std::string file = std::string(robot) + kSocket;
  const Gate gate(*this);
  Descriptor other;
  const State before = probe(robot, other);
  if (before == State::kListening) {
    throw SegmentError(Kind::kInUse, path + ": in use by another real-time task, pid " +
                                         std::to_string(peer_pid(other)) +
                                         "; stop it with 'corbot down', or give this robot another name");
  }
  if (before == State::kLeftBehind) remove(robot, kSocket);
  Listening result{make_socket(path), before == State::kLeftBehind, 0, 0};
  const int fd = result.socket.get();
  const sockaddr_un address = address_in(fd_, robot);
  if (::fchmod(fd, 0600) != 0 ||
      ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    throw_system(path, "bind", errno);
  const auto give_to_group = [&] {
    return !group ||
           (::fchownat(fd_.get(), file.c_str(), static_cast<uid_t>(-1), *group, AT_SYMLINK_NOFOLLOW) == 0 &&
            ::fchmodat(fd_.get(), file.c_str(), 0660, 0) == 0);
  };
  if (!give_to_group() || ::listen(fd, kBacklog) != 0) {
    const int error = errno;
    remove(robot, kSocket);
    throw_system(path, "listen", error);
  }
  struct stat status {};
  if (::fstatat(fd_.get(), file.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0)
    throw_system(path, "stat", errno);
  result.device = status.st_dev;
  result.inode = status.st_ino;
  return result;
}

bool RunDirectory::is_found(std::string_view robot, const Listening& listening) const noexcept {
  struct stat status {};
  return ::lstat(socket_path(robot).c_str(), &status) == 0 && status.st_dev == listening.device &&
         status.st_ino == listening.inode;
}

Descriptor RunDirectory::connect(std::string_view robot) const {
  check_robot_name(robot);
  Descriptor connection;
  switch (probe(robot, connection)) {
    case State::kListening:
      return connection;
    case State::kNone:
      throw SegmentError(Kind::kAbsent, socket_path(robot) +
                                            ": absent: no real-time task runs for this robot; start it with "
                                            "'corbot up'");
    case State::kLeftBehind:
      break;
  }
  throw SegmentError(Kind::kAbsent, socket_path(robot) +
                                        ": the real-time task of this robot is gone; start it again with "
                                        "'corbot up'");
}

void RunDirectory::remove(std::string_view robot, const char* file) const noexcept {
  ::unlinkat(fd_.get(), (std::string(robot) + file).c_str(), 0);
}

std::optional<std::uint64_t> RunDirectory::last_task(std::string_view robot) const noexcept {
  const std::string file = std::string(robot) + kLastTask;
  const Descriptor fd(::openat(fd_.get(), file.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat status {};
  if (!fd || ::fstat(fd.get(), &status) != 0 || !S_ISREG(status.st_mode) || status.st_uid != ::geteuid() ||
      (status.st_mode & 0077) != 0)
    return std::nullopt;
  std::uint64_t id = 0;
  if (::read(fd.get(), &id, sizeof(id)) != sizeof(id)) return std::nullopt;
  return id;
}

bool RunDirectory::set_last_task(std::string_view robot, std::uint64_t segment) const noexcept {
  const std::string file = std::string(robot) + kLastTask;
  const std::string next = file + ".new";
  const Descriptor fd(
      ::openat(fd_.get(), next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (fd && ::write(fd.get(), &segment, sizeof(segment)) == sizeof(segment) &&
      ::renameat(fd_.get(), next.c_str(), fd_.get(), file.c_str()) == 0)
    return true;
  ::unlinkat(fd_.get(), next.c_str(), 0);
  ::unlinkat(fd_.get(), file.c_str(), 0);
  return false;
}

bool RunDirectory::remove_left_behind(std::string_view robot) const {
  const Gate gate(*this);
  Descriptor connection;
  const State state = probe(robot, connection);
  if (state == State::kListening) return false;
  remove(robot, kSocket);
  remove(robot, kLastTask);
  return state == State::kLeftBehind;
}

std::vector<std::string> RunDirectory::robots(bool living) const {
  std::vector<std::string> robots;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(path_, error)) {
    if (entry.path().extension() != kSocket) continue;
    const std::string robot = entry.path().stem().string();
    bool lives = true;
    try {
      check_robot_name(robot);
      Descriptor connection;
      const State state = probe(robot, connection);
      if (state == State::kNone) continue;
      lives = state == State::kListening;
    } catch (const SegmentError& refused) {
      // The task does not answer, or not to this user.
      if (refused.kind() != Kind::kSilent && refused.kind() != Kind::kPermission) continue;
    }
    if (lives == living) robots.push_back(robot);
  }
  std::sort(robots.begin(), robots.end());
  return robots;
}

bool remove_left_behind(const std::string& robot) noexcept {
  try {
    const auto directory = RunDirectory::open(false);
    return directory && directory->remove_left_behind(robot);
  } catch (const std::exception&) {
    return false;
  }
}

std::vector<std::string> sockets_left_behind() {
  try {
    const auto directory = RunDirectory::open(false);
    return directory ? directory->left_behind() : std::vector<std::string>{};
  } catch (const SegmentError&) {
    return {};  // another user's directory: none of ours
  }
}

}  // namespace corbot
