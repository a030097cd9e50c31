// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/filter.h>
#include <linux/sockios.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <stdexcept>
#include <thread>

namespace corbot::test {

/// A connection falls silent as if the machine at this end had lost its network: nothing arrives here, and
/// nothing is acknowledged. Once for each. Throws std::runtime_error where the kernel has no filters.
inline void fall_silent(int socket) {
  // Waits until all sent bytes are acknowledged: a machine that is gone repeats nothing. A connection that
  // was reset never acknowledges them.
  const auto has_ended = [socket] {
    pollfd polled{socket, 0, 0};
    return ::poll(&polled, 1, 0) > 0;
  };
  int unacknowledged = 1;
  while (::ioctl(socket, SIOCOUTQ, &unacknowledged) == 0 && unacknowledged > 0 && !has_ended())
    std::this_thread::yield();
  // Drops the packets that the kernel receives for the socket, before it acknowledges them.
  sock_filter nothing[] = {{BPF_RET | BPF_K, 0, 0, 0}};
  const sock_fprog program{1, nothing};
  if (::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof(program)) != 0)
    throw std::runtime_error("no filter for the connection");
}

}  // namespace corbot::test
