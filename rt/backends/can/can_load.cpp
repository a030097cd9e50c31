// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/can_load.h"

#include <linux/can/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "rt/backends/can/cia402.h"

namespace corbot::rt {
namespace {

const rtattr* next(const rtattr* attribute, int& length) {
  const int bytes = static_cast<int>(RTA_ALIGN(attribute->rta_len));
  length -= bytes;
  return reinterpret_cast<const rtattr*>(reinterpret_cast<const std::byte*>(attribute) + bytes);
}

/// The attribute of this type in a row of them; null when there is none.
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

struct LinkRequest {
  nlmsghdr header;
  ifinfomsg link;
};

std::optional<std::uint32_t> ask(int fd, unsigned index) {
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
  const auto* const header = reinterpret_cast<const nlmsghdr*>(answer.data());
  if (n <= 0 || !NLMSG_OK(header, static_cast<unsigned>(n)) || header->nlmsg_type != RTM_NEWLINK ||
      header->nlmsg_len < NLMSG_LENGTH(sizeof(ifinfomsg))) {
    return std::nullopt;
  }
  const auto* const link = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
  const rtattr* const info = find(IFLA_RTA(link), IFLA_PAYLOAD(header), IFLA_LINKINFO);
  const rtattr* const timing = find_in(find_in(info, IFLA_INFO_DATA), IFLA_CAN_BITTIMING);
  if (timing == nullptr || RTA_PAYLOAD(timing) < sizeof(can_bittiming)) return std::nullopt;
  can_bittiming bits{};
  std::memcpy(&bits, RTA_DATA(timing), sizeof(bits));
  return bits.bitrate > 0 ? std::optional(bits.bitrate) : std::nullopt;
}

}  // namespace

std::int64_t needed_bit_rate(std::size_t drives, std::int64_t period_ns) noexcept {
  const double bits_per_s = static_cast<double>(cycle_bits(drives)) * 1e9 / static_cast<double>(period_ns);
  return std::llround(std::ceil(bits_per_s / kBusShare));
}

std::optional<std::int64_t> sync_period_ns(std::size_t drives, std::int64_t loop_ns,
                                           std::uint32_t bit_rate) noexcept {
  if (loop_ns <= 0) return std::nullopt;
  for (std::int64_t period_ns = loop_ns; period_ns <= kLongestSyncPeriod_ns; period_ns += loop_ns) {
    if (bit_rate != 0 && needed_bit_rate(drives, period_ns) > bit_rate) continue;
    if (interpolation_time(period_ns)) return period_ns;
  }
  return std::nullopt;
}

std::optional<std::uint32_t> bit_rate_of(const std::string& interface) noexcept {
  const unsigned index = ::if_nametoindex(interface.c_str());
  if (index == 0) return std::nullopt;
  const int fd = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (fd < 0) return std::nullopt;
  const auto rate = ask(fd, index);
  ::close(fd);
  return rate;
}

}  // namespace corbot::rt
