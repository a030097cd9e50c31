// SPDX-License-Identifier: Apache-2.0
// Checks the kernel's messages on an interface, as rtnetlink(7) and linux/can/netlink.h define them.
#include "rt/backends/can/can_link.h"

#include <gmock/gmock.h>
#include <linux/can/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "rt/backends/can/can_port.h"
#include "support/paths.h"

namespace corbot::rt {
namespace {

using Bytes = std::vector<std::byte>;

template <class Value>
Bytes bytes_of(const Value& value) {
  Bytes bytes(sizeof(value));
  std::memcpy(bytes.data(), &value, sizeof(value));
  return bytes;
}

void append(Bytes& all, const Bytes& more) { all.insert(all.end(), more.begin(), more.end()); }

Bytes attribute(unsigned type, const Bytes& data) {
  Bytes all = bytes_of(
      rtattr{static_cast<unsigned short>(RTA_LENGTH(data.size())), static_cast<unsigned short>(type)});
  append(all, data);
  all.resize(RTA_ALIGN(all.size()));
  return all;
}

Bytes message(const ifinfomsg& link, const Bytes& attributes) {
  nlmsghdr header{};
  header.nlmsg_type = RTM_NEWLINK;
  header.nlmsg_len = static_cast<std::uint32_t>(NLMSG_LENGTH(sizeof(link)) + attributes.size());
  Bytes all = bytes_of(header);
  append(all, bytes_of(link));
  append(all, attributes);
  return all;
}

ifinfomsg link_of(unsigned short type, unsigned flags) {
  ifinfomsg link{};
  link.ifi_type = type;
  link.ifi_flags = flags;
  return link;
}

/// As of `ip link set can0 up type can bitrate 500000 restart-ms 100`, off the bus.
Bytes can0() {
  can_bittiming timing{};
  timing.bitrate = 500'000;
  Bytes data = attribute(IFLA_CAN_BITTIMING, bytes_of(timing));
  append(data, attribute(IFLA_CAN_STATE, bytes_of(std::uint32_t{CAN_STATE_BUS_OFF})));
  append(data, attribute(IFLA_CAN_RESTART_MS, bytes_of(std::uint32_t{100})));
  Bytes info = attribute(IFLA_INFO_KIND, {std::byte{'c'}, std::byte{'a'}, std::byte{'n'}, std::byte{0}});
  append(info, attribute(IFLA_INFO_DATA | NLA_F_NESTED, data));
  Bytes attributes = attribute(IFLA_TXQLEN, bytes_of(std::uint32_t{10}));
  append(attributes, attribute(IFLA_LINKINFO | NLA_F_NESTED, info));
  return message(link_of(ARPHRD_CAN, IFF_UP), attributes);
}

TEST(CanLink, OfAControllerHasRateStateAndRestart) {
  const auto link = parse_can_link(can0());
  ASSERT_TRUE(link);
  EXPECT_TRUE(link->is_can);
  EXPECT_TRUE(link->is_up);
  EXPECT_EQ(link->queue, 10u);
  EXPECT_EQ(link->bit_rate, 500'000u);
  EXPECT_EQ(link->state, CanBusState::kBusOff);
  EXPECT_EQ(link->restart_ms, 100u);
}

TEST(CanLink, OfAVirtualInterfaceHasNone) {
  const auto link = parse_can_link(message(link_of(ARPHRD_CAN, 0), {}));
  ASSERT_TRUE(link);
  EXPECT_TRUE(link->is_can);
  EXPECT_FALSE(link->is_up);
  EXPECT_FALSE(link->bit_rate);
  EXPECT_FALSE(link->state);
  EXPECT_FALSE(link->restart_ms);
}

TEST(CanLink, ACutOrForgedMessageIsNotReadBeyondItsEnd) {
  const Bytes whole = can0();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    // On the heap and of this very size, so that the sanitizers see a byte too many.
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(parse_can_link(cut)) << size;
  }
  for (std::size_t at = sizeof(nlmsghdr); at < whole.size(); ++at) {
    for (const int value : {0, 1, 3, 0x7F, 0xFF}) {
      Bytes forged = whole;
      forged[at] = static_cast<std::byte>(value);
      EXPECT_TRUE(parse_can_link(forged)) << at;
    }
  }
}

TEST(CanLink, TheKernelIsAsked) {
  const auto loopback = read_can_link("lo");
  ASSERT_TRUE(loopback);
  EXPECT_FALSE(loopback->is_can);
  EXPECT_FALSE(read_can_link("no-such-thing"));
}

TEST(Port, AFileIsNoCanBus) {
  const std::string path = CORBOT_SCRATCH_DIR "/no-bus-" + std::to_string(::getpid());
  std::ofstream(path) << "x";
  try {
    CanPort().open("unix:" + path, {});
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("is a file, not the socket of a virtual CAN bus"));
  }
  ::unlink(path.c_str());
}

}  // namespace
}  // namespace corbot::rt
