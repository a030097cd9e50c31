// SPDX-License-Identifier: Apache-2.0
#include "sim/scene/servo_socket.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

namespace corbot::sim {

ServoSocket::ServoSocket(const std::string& path, Ssc32Options options)
    : listener_(path, SOCK_STREAM, 0600), device_(std::move(options)) {}

void ServoSocket::add_to(std::vector<pollfd>& fds) const {
  fds.push_back({listener_.fd(), POLLIN, 0});
  if (has_client()) fds.push_back({client_, POLLIN, 0});
}

void ServoSocket::step(std::int64_t now_ns) {
  if (has_client()) receive(now_ns);
  // After the client's end was read: its successor waits already.
  for (int next = -1; (next = listener_.accept()) >= 0;) {
    if (has_client()) {
      ::close(next);
    } else {
      client_ = next;
    }
  }
  // Without a client, or if it takes no more, the answers are lost, as on a line without a reader.
  const std::vector<std::uint8_t> answers = device_.answers(now_ns);
  if (has_client() && !answers.empty())
    (void)::send(client_, answers.data(), answers.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

std::optional<std::int64_t> ServoSocket::next_answer_ns() const { return device_.next_answer_ns(); }

void ServoSocket::receive(std::int64_t now_ns) {
  std::array<std::uint8_t, 4096> bytes{};
  const ssize_t n = ::recv(client_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (n > 0) return device_.receive({bytes.data(), static_cast<std::size_t>(n)}, now_ns);
  if (n == 0 || (errno != EAGAIN && errno != EINTR)) drop_client();
}

void ServoSocket::drop_client() {
  if (has_client()) ::close(std::exchange(client_, -1));
}

}  // namespace corbot::sim
