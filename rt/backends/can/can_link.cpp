// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/can_link.h"

#include <linux/can/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>

namespace corbot::rt {
namespace {

const rtattr* next(const rtattr* attribute, int& length) {
  const int bytes = static_cast<int>(RTA_ALIGN(attribute->rta_len));
  length -= bytes;
  return reinterpret_cast<const rtattr*>(reinterpret_cast<const std::byte*>(attribute) + bytes);
}

/// Returns the attribute of this type from a row of attributes; null if there is none.
const rtattr* find(const rtattr* attribute, std::size_t bytes, unsigned type) {
  int length = static_cast<int>(bytes);
  for (; RTA_OK(attribute, length); attribute = next(attribute, length)) {
    if ((attribute->rta_type & NLA_TYPE_MASK) == type) return attribute;
  }
  return nullptr;
}

const rtattr* find_in(const rtattr* nest, unsigned type) {
  if (nest == nullptr) return nullptr;
  return find(static_cast<const rtattr*>(RTA_DATA(nest)), RTA_PAYLOAD(nest), type);
}

std::optional<std::uint32_t> number_of(const rtattr* attribute) {
  std::uint32_t value = 0;
  if (attribute == nullptr || RTA_PAYLOAD(attribute) < sizeof(value)) return std::nullopt;
  std::memcpy(&value, RTA_DATA(attribute), sizeof(value));
  return value;
}

struct LinkRequest {
  nlmsghdr header;
  ifinfomsg link;
};

std::optional<CanLink> ask(int fd, unsigned index) {
  LinkRequest request{};
  request.header.nlmsg_len = sizeof(request);
  request.header.nlmsg_type = RTM_GETLINK;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.link.ifi_index = static_cast<int>(index);
  if (::send(fd, &request, sizeof(request), 0) != static_cast<ssize_t>(sizeof(request))) return std::nullopt;
  alignas(nlmsghdr) std::array<std::byte, 16384> answer{};
  const timeval patience{1, 0};
  (void)::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  const ssize_t n = ::recv(fd, answer.data(), answer.size(), 0);
  return n <= 0 ? std::nullopt : parse_can_link(std::span(answer).first(static_cast<std::size_t>(n)));
}

}  // namespace

const char* to_string(CanBusState state) noexcept {
  switch (state) {
    case CanBusState::kErrorActive:
      return "ERROR-ACTIVE";
    case CanBusState::kErrorWarning:
      return "ERROR-WARNING";
    case CanBusState::kErrorPassive:
      return "ERROR-PASSIVE";
    case CanBusState::kBusOff:
      return "BUS-OFF";
    case CanBusState::kStopped:
      return "STOPPED";
    case CanBusState::kSleeping:
      return "SLEEPING";
  }
  return "in a state that this version does not know";
}

std::optional<CanLink> parse_can_link(std::span<const std::byte> message) noexcept {
  const auto* const header = reinterpret_cast<const nlmsghdr*>(message.data());
  if (message.size() < sizeof(nlmsghdr) || !NLMSG_OK(header, static_cast<unsigned>(message.size())) ||
      header->nlmsg_type != RTM_NEWLINK || header->nlmsg_len < NLMSG_LENGTH(sizeof(ifinfomsg))) {
    return std::nullopt;
  }
  const auto* const link = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
  const rtattr* const attributes = IFLA_RTA(link);
  const std::size_t bytes = IFLA_PAYLOAD(header);
  CanLink found;
  found.is_can = link->ifi_type == ARPHRD_CAN;
  found.is_up = (link->ifi_flags & IFF_UP) != 0;
  found.queue = number_of(find(attributes, bytes, IFLA_TXQLEN)).value_or(0);
  if (!found.is_can) return found;
  const rtattr* const data = find_in(find(attributes, bytes, IFLA_LINKINFO), IFLA_INFO_DATA);
  if (const rtattr* const timing = find_in(data, IFLA_CAN_BITTIMING);
      timing != nullptr && RTA_PAYLOAD(timing) >= sizeof(can_bittiming)) {
    can_bittiming bits{};
    std::memcpy(&bits, RTA_DATA(timing), sizeof(bits));
    if (bits.bitrate > 0) found.bit_rate = bits.bitrate;
  }
  if (const auto state = number_of(find_in(data, IFLA_CAN_STATE)))
    found.state = static_cast<CanBusState>(*state);
  found.restart_ms = number_of(find_in(data, IFLA_CAN_RESTART_MS));
  return found;
}

std::optional<CanLink> read_can_link(const std::string& interface) noexcept {
  const unsigned index = ::if_nametoindex(interface.c_str());
  if (index == 0) return std::nullopt;
  const int fd = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (fd < 0) return std::nullopt;
  const auto link = ask(fd, index);
  ::close(fd);
  return link;
}

}  // namespace corbot::rt
