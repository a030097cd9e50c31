// SPDX-License-Identifier: Apache-2.0
#include "support/giop_message.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace corbot::test {
namespace {

constexpr std::size_t kHeader = 12;
constexpr char kMagic[] = "GIOP";
enum : char { kRequest = 0, kReply = 1, kLocateReply = 4 };

char minor_of(const std::string& message) { return message[5]; }
char type_of(const std::string& message) { return message[7]; }
bool is_giop(const std::string& bytes) {
  return bytes.size() >= kHeader && bytes.starts_with(std::string_view(kMagic, 4));
}

/// Bytes beyond the end count as zero.
std::uint32_t u32_at(const std::string& message, std::size_t at) {
  const bool little_endian = (message[6] & 1) != 0;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t from = at + (little_endian ? 3 - i : i);
    value = value << 8 | (from < message.size() ? static_cast<std::uint8_t>(message[from]) : 0u);
  }
  return value;
}

constexpr std::size_t aligned(std::size_t at) { return (at + 3) / 4 * 4; }

/// Returns the offset of the request's number in a Reply. Before GIOP 1.2 it stands behind the service
/// contexts.
std::size_t number_in_reply(const std::string& message) {
  if (minor_of(message) >= 2) return kHeader;
  std::size_t at = kHeader + 4;
  for (std::uint32_t left = u32_at(message, kHeader); left > 0 && at < message.size(); --left)
    at = aligned(at) + 8 + u32_at(message, aligned(at) + 4);
  return aligned(at);
}

}  // namespace

std::optional<std::string> take_message(std::string& stream) {
  if (stream.empty()) return std::nullopt;
  const std::size_t known = std::min<std::size_t>(stream.size(), 4);
  if (stream.compare(0, known, kMagic, known) != 0) return std::exchange(stream, {});
  if (stream.size() < kHeader || stream.size() < kHeader + u32_at(stream, 8)) return std::nullopt;
  const std::size_t size = kHeader + u32_at(stream, 8);
  std::string message = stream.substr(0, size);
  stream.erase(0, size);
  return message;
}

bool is_request_of(const std::string& message, const std::string& operation) {
  if (!is_giop(message) || type_of(message) != kRequest) return false;
  const std::string text = operation + '\0';
  for (std::size_t at = message.find(text); at != std::string::npos; at = message.find(text, at + 1)) {
    if (u32_at(message, at - 4) == text.size()) return true;
  }
  return false;
}

bool is_reply(const std::string& message) { return is_giop(message) && type_of(message) == kReply; }

bool is_forward(const std::string& message) {
  if (!is_giop(message)) return false;
  if (type_of(message) == kReply) {
    const std::uint32_t status = u32_at(message, number_in_reply(message) + 4);
    return status == 3 || status == 4;
  }
  if (type_of(message) != kLocateReply) return false;
  const std::uint32_t status = u32_at(message, kHeader + 4);
  return status == 2 || status == 3;
}

}  // namespace corbot::test
