// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "support/process.h"

namespace corbot::test {

/// Messages written by hand, right and wrong: what a hostile or broken client sends.
std::string giop_header(std::uint8_t type, std::size_t size, bool more_fragments = false,
                        std::uint8_t minor = 0);
/// A GIOP 1.0 request; `arguments` are doubles.
std::string giop_request(std::uint32_t id, const std::string& key, const std::string& operation,
                         const std::vector<double>& arguments = {});

/// A GIOP 1.2 request in two messages, the first with `first` bytes of its body (4 more than a multiple of
/// 8). Those of several requests may be interleaved.
struct GiopFragments {
  std::string first;
  std::string last;
};
GiopFragments giop_fragments(std::uint32_t id, const std::string& key, const std::string& operation,
                             const std::vector<double>& arguments, std::size_t first);

/// A reply's status (0 result, 1 user exception, 2 system exception, 3 forward) and what follows it.
struct GiopReply {
  std::uint32_t id;
  std::uint32_t status;
  std::string body;
};

/// A TCP connection to a server on the loopback interface.
class RawConnection {
 public:
  explicit RawConnection(int port);
  RawConnection(RawConnection&& other) noexcept;
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;
  RawConnection& operator=(RawConnection&&) = delete;
  ~RawConnection();

  [[nodiscard]] bool connected() const { return fd_ >= 0; }
  /// By which the server knows it.
  [[nodiscard]] int local_port() const;
  /// False when the peer has closed.
  bool send(const std::string& bytes);
  /// The next reply; nothing when the connection ends or the deadline passes first.
  std::optional<GiopReply> reply(Deadline deadline);
  /// Whether the peer has closed by then.
  bool closed(Deadline deadline);

  /// Three ways for a client to go. By its process's end:
  void close();
  /// With what is under way cut off (RST):
  void reset();
  /// As if its machine had lost its network: nothing arrives there, and nothing is acknowledged. Throws
  /// std::runtime_error where the kernel has no filters.
  void fall_silent();

 private:
  bool read_more(Deadline deadline);

  int fd_ = -1;
  std::string received_;
};

}  // namespace corbot::test
