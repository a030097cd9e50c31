// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_world.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>

#include "client/explain.h"
#include "client/failure.h"

namespace corbot::cli {

namespace {

constexpr const char* kWorld = "world";

}  // namespace

std::optional<CellWorld> CellWorld::find(const cell::CellConfig& cell) {
  if (!cell.scene) return std::nullopt;
  const std::string path = cell.picture_socket();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  const Descriptor client(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (client.get() < 0) throw client::system_failure(path, errno);
  if (::connect(client.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    return std::nullopt;
  ucred peer{};
  socklen_t size = sizeof(peer);
  struct stat socket {};
  if (::getsockopt(client.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 ||
      ::stat(path.c_str(), &socket) != 0)
    throw client::system_failure(path, errno);
  Descriptor process(static_cast<int>(::syscall(SYS_pidfd_open, peer.pid, 0)));
  if (process.get() < 0) throw client::system_failure(fmt::format("process {}", peer.pid), errno);
  return CellWorld(std::move(process),
                   fmt::format("{} {}.{:09}", peer.pid, socket.st_mtim.tv_sec, socket.st_mtim.tv_nsec),
                   cell.state_directory / kWorld);
}

bool CellWorld::has_ledger() const {
  std::ifstream file(file_);
  std::string identity;
  return std::getline(file, identity) && identity == identity_;
}

void CellWorld::take_ledger() const {
  std::ofstream file(file_);
  if (!(file << identity_ << '\n').flush())
    throw client::system_failure(file_.string() + ": cannot be written", errno);
}

bool CellWorld::has_ended() const {
  pollfd process{process_.get(), POLLIN, 0};
  return ::poll(&process, 1, 0) != 0;
}

}  // namespace corbot::cli
