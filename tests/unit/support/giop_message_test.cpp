// SPDX-License-Identifier: Apache-2.0
#include "support/giop_message.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace corbot::test {
namespace {

std::string u32(std::uint32_t value, bool little_endian) {
  std::string bytes;
  for (int i = 0; i < 4; ++i)
    bytes.push_back(static_cast<char>(value >> (little_endian ? 8 * i : 24 - 8 * i)));
  return bytes;
}

std::string message(char type, char minor, bool little_endian, const std::string& body) {
  std::string text("GIOP\1");
  text += minor;
  text += static_cast<char>(little_endian);
  text += type;
  return text + u32(static_cast<std::uint32_t>(body.size()), little_endian) + body;
}

constexpr char kReply = 1;
constexpr char kLocateReply = 4;

TEST(GiopMessage, KnowsEveryWayOfForwarding) {
  for (const bool little : {false, true}) {
    const auto number = [&](std::uint32_t value) { return u32(value, little); };
    // One service context of three bytes.
    const std::string contexts = number(1) + number(17) + number(3) + std::string(4, 'x');
    for (std::uint32_t status = 0; status < 6; ++status) {
      const bool forwards = status == 3 || status == 4;
      EXPECT_EQ(is_forward(message(kReply, 2, little, number(7) + number(status) + contexts)), forwards);
      EXPECT_EQ(is_forward(message(kReply, 0, little, contexts + number(7) + number(status))), forwards);
      EXPECT_EQ(is_forward(message(kReply, 1, little, number(0) + number(7) + number(status))), forwards);
    }
    for (std::uint32_t status = 0; status < 6; ++status) {
      const std::string reply = message(kLocateReply, 2, little, number(7) + number(status));
      EXPECT_EQ(is_forward(reply), status == 2 || status == 3);
      EXPECT_FALSE(is_reply(reply));
    }
  }
}

TEST(GiopMessage, KnowsAnOperationByItsWholeName) {
  const auto request = [](const std::string& operation) {
    return message(
        0, 2, true,
        u32(1, true) + u32(static_cast<std::uint32_t>(operation.size() + 1), true) + operation + '\0');
  };
  EXPECT_TRUE(is_request_of(request("Drive"), "Drive"));
  EXPECT_FALSE(is_request_of(request("StartDrive"), "Drive"));
  EXPECT_TRUE(is_request_of(request("StartDrive"), "StartDrive"));
}

TEST(GiopMessage, IsTakenWhole) {
  const std::string first = message(kReply, 2, true, u32(1, true) + u32(0, true));
  std::string stream = first + first.substr(0, 15);
  EXPECT_EQ(take_message(stream), first);
  EXPECT_EQ(take_message(stream), std::nullopt);
  stream += first.substr(15);
  EXPECT_EQ(take_message(stream), first);
  stream = "no message";
  EXPECT_EQ(take_message(stream), "no message");
  EXPECT_EQ(stream, "");
}

}  // namespace
}  // namespace corbot::test
