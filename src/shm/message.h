// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "corbot/channel/layout.h"
#include "shm/descriptor.h"
#include "shm/segment_error.h"

// The messages between a real-time task and the processes that connect to it, over a Unix socket that keeps
// the boundaries of messages. Not real-time safe.

namespace corbot {

enum class MessageType : std::uint32_t {
  kServantHello = 1,   ///< with the servant's segment, and the last task's if it has one
  kObserverHello = 2,  ///< requests to read
  kStopHello = 3,      ///< requests to stop, and to read the result
  kWelcome = 4,        ///< with the segments that the role may have
  kRefused = 5,        ///< with kind and text of the SegmentError
  kReady = 6,          ///< the servant has set its tails: its segment may be used
};

/// The segments whose descriptors a message carries, in the order of the bits.
enum : std::uint32_t { kCarriesTask = 1, kCarriesServant = 2, kCarriesStop = 4 };
inline constexpr std::size_t kCarriedAtMost = 3;

struct Message {
  struct Record {  ///< as sent
    std::uint64_t magic{kSegmentMagic};
    std::uint32_t abi{kSegmentAbi};
    MessageType type{};
    std::uint32_t carries{0};
    std::uint32_t error{0};  ///< SegmentError::Kind
    std::uint64_t fingerprint{0};
    std::uint64_t session{0};
    char robot[kMaxSegmentName + 8]{};
    char text[400]{};
  } record;
  Descriptor task, servant, stop;

  [[nodiscard]] static Message make(MessageType type, std::string_view robot);
  [[nodiscard]] static Message refusal(std::string_view robot, const SegmentError& error);
  [[nodiscard]] SegmentError error() const;  ///< of a refusal
  [[nodiscard]] std::string robot() const;
};

/// A descriptor to be sent, which stays the caller's.
struct Carried {
  std::uint32_t which;
  int fd;
};

/// Sends a message. Returns false if it could not be sent at once.
[[nodiscard]] bool send_message(const Descriptor& connection, Message message,
                                std::initializer_list<Carried> carried = {});

enum class Received { kMessage, kNothing, kClosed };
/// Receives a message without waiting. kClosed also for data that is no message; a kMessage of another
/// version carries nothing.
[[nodiscard]] Received receive_message(const Descriptor& connection, Message& message);

/// Returns true if the peer process has closed the connection or died, and all of its messages are read. One
/// system call; takes nothing from the connection.
[[nodiscard]] bool is_closed(const Descriptor& connection) noexcept;
/// Returns true if the peer process has closed the connection; its last messages may be unread.
[[nodiscard]] bool has_hung_up(const Descriptor& connection) noexcept;

[[nodiscard]] ucred peer_of(const Descriptor& connection) noexcept;

}  // namespace corbot
