// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <array>
#include <initializer_list>
#include <utility>
#include <vector>

#include "sim/devices/cia402_node.h"

namespace corbot::sim {

using State = Cia402Drive::State;

/// An emulated drive, node 5, without a bus and without a clock.
class Node : public ::testing::Test {
 protected:
  Node() {
    node_.advance(now_ns_);
    (void)node_.take_sent();
  }
  std::vector<can_frame> say(canid_t id, std::initializer_list<int> bytes) {
    can_frame frame{};
    frame.can_id = id;
    for (const int byte : bytes) frame.data[frame.can_dlc++] = static_cast<std::uint8_t>(byte);
    node_.receive(frame, now_ns_);
    return node_.take_sent();
  }
  std::vector<can_frame> wait_ms(int ms) {
    for (int i = 0; i < ms; ++i) node_.advance(now_ns_ += 1'000'000);
    return node_.take_sent();
  }
  static std::uint32_t number(const can_frame& frame, std::size_t offset, std::size_t bytes) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i)
      value |= static_cast<std::uint32_t>(frame.data[offset + i]) << (8 * i);
    return value;
  }
  /// The abort code, 0 for a success.
  std::uint32_t write(int index, int sub, std::uint32_t value, int bytes) {
    const auto b = [&](int i) { return static_cast<int>(value >> (8 * i) & 0xFF); };
    const auto answer =
        say(0x605, {0x23 | (4 - bytes) << 2, index & 0xFF, index >> 8, sub, b(0), b(1), b(2), b(3)});
    if (answer.empty() || answer[0].can_id != 0x585) return 1;
    return answer[0].data[0] == 0x60 ? 0 : number(answer[0], 4, 4);
  }
  std::pair<int, std::uint32_t> read(int index, int sub = 0) {
    const auto answer = say(0x605, {0x40, index & 0xFF, index >> 8, sub, 0, 0, 0, 0});
    if (answer.size() != 1) return {-1, 0};
    return {answer[0].data[0], number(answer[0], 4, 4)};
  }
  /// As the backend sets it up, and enabled.
  void enable() {
    const std::initializer_list<std::array<std::uint32_t, 4>> writes{
        {0x1400, 1, 0x80000205, 4}, {0x1600, 0, 0, 1},          {0x1600, 1, 0x60400010, 4},
        {0x1600, 2, 0x607A0020, 4}, {0x1400, 2, 1, 1},          {0x1600, 0, 2, 1},
        {0x1400, 1, 0x205, 4},      {0x1800, 1, 0x80000185, 4}, {0x1A00, 0, 0, 1},
        {0x1A00, 1, 0x60410010, 4}, {0x1A00, 2, 0x60640020, 4}, {0x1800, 2, 1, 1},
        {0x1A00, 0, 2, 1},          {0x1800, 1, 0x185, 4},      {0x6060, 0, 8, 1}};
    for (const auto& w : writes) {
      ASSERT_EQ(write(static_cast<int>(w[0]), static_cast<int>(w[1]), w[2], static_cast<int>(w[3])), 0u)
          << std::hex << w[0] << ":" << w[1];
    }
    say(0, {1, 5});
    for (const int word : {6, 7, 15}) cycle(word, 0);
    ASSERT_EQ(node_.drive().state(), State::kOperationEnabled);
  }
  /// RPDO and SYNC, then a millisecond; the TPDO.
  std::vector<can_frame> cycle(int word, int target) {
    const auto t = static_cast<unsigned>(target);
    const auto b = [&](int i) { return static_cast<int>(t >> (8 * i) & 0xFF); };
    EXPECT_THAT(say(0x205, {word & 0xFF, word >> 8, b(0), b(1), b(2), b(3)}), testing::IsEmpty())
        << "waits for SYNC";
    auto sent = say(0x080, {});
    node_.advance(now_ns_ += 1'000'000);
    return sent;
  }

  std::int64_t now_ns_{1'000'000'000};
  Cia402Node node_{5, {}};
};

}  // namespace corbot::sim
