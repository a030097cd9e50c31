// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/number.h"
#include "net/ports.h"

namespace corbot::client {
namespace {

using testing::HasSubstr;

TEST(Number, ReadsDecimals) {
  EXPECT_EQ(parse_number("0.25"), 0.25);
  EXPECT_EQ(parse_number("-0.25"), -0.25);
  EXPECT_EQ(parse_number("+3"), 3.0);
  EXPECT_EQ(parse_number("-.5"), -0.5);
  EXPECT_EQ(parse_number("1e-3"), 0.001);
  EXPECT_EQ(parse_number("1e308"), 1e308);
}

TEST(Number, RefusesWhatIsNotOne) {
  for (const char* word : {"", "-", "+", "+-1", "++1", "1.2.3", "0,2", "1x", " 1", "1 ", "0x10", "inf",
                           "-inf", "nan", "1e309", "one"}) {
    EXPECT_FALSE(parse_number(word)) << "'" << word << "'";
  }
}

// Option parsers read "010" as 8, and "-1" as a large number without a sign.
TEST(Number, AWholeOneIsWrittenPlainly) {
  for (const char* word : {"1", "9", "10"}) EXPECT_EQ(whole_number_fault(word, 1, 10), "") << word;
  for (const char* word : {"", "0", "11", "-1", "010", "+1", "1.0", "1x", "0x1", "99999999999999999999"})
    EXPECT_THAT(whole_number_fault(word, 1, 10), HasSubstr("is not a whole number from 1 to 10")) << word;
}

TEST(Number, SaysWhy) {
  EXPECT_THAT(number_fault("0,2"), HasSubstr("decimal point"));
  EXPECT_THAT(number_fault("nan"), HasSubstr("not a finite number"));
  EXPECT_THAT(number_fault("1e309"), HasSubstr("too large or too small"));
  for (const char* word : {"200mm", "0.2m", "50%"})
    EXPECT_THAT(number_fault(word), HasSubstr("write it without '")) << word;
  EXPECT_THAT(number_fault("1.2.3"), testing::EndsWith("is not a number"));
  EXPECT_THAT(number_fault("x"), HasSubstr("'x' is not a number"));
}

TEST(Integer, ReadsWholeWordsOnly) {
  EXPECT_EQ(parse_integer("3"), 3);
  EXPECT_EQ(parse_integer("-1"), -1);
  for (const char* word : {"", "1.5", "1e2", "99999999999", "3a"}) EXPECT_FALSE(parse_integer(word)) << word;
}

TEST(CommandLine, ProtectsNegativeNumbersOnly) {
  const char* argv[] = {"corbot", "move", "-.5", "-0.5", "-x", "-.x", "--time"};
  EXPECT_THAT(protect_negative_numbers(7, argv),
              testing::ElementsAre("move", "-0.5", "-0.5", "-x", "-.x", "--time"));
}

TEST(Endpoint, IsHostAndPort) {
  EXPECT_EQ(net::split_endpoint("127.0.0.1:12810"), (std::pair<std::string, int>{"127.0.0.1", 12810}));
  for (const char* text : {"", "localhost", ":1", "h:", "h:-1", "h:0", "h:65536", "h:x"}) {
    EXPECT_FALSE(net::split_endpoint(text)) << text;
  }
}

TEST(Endpoint, OfIPv6IsInBrackets) {
  EXPECT_EQ(net::split_endpoint("[::1]:12810"), (std::pair<std::string, int>{"::1", 12810}));
  EXPECT_EQ(net::endpoint_text("::1", 12810), "[::1]:12810");
  EXPECT_EQ(net::endpoint_text("arm", 12810), "arm:12810");
  for (const char* text :
       {"::1:12810", "[::1]", "[::1]12810", "[::1:12810", "[127.0.0.1]:1", "[]:1", "[::1]:"}) {
    EXPECT_FALSE(net::split_endpoint(text)) << text;
  }
}

TEST(Endpoint, MeansOneAddress) {
  for (const char* host : {"0", "0.0", "0.0.0.0", "0x0", "00", "*", "[::]", "[0:0::0]", "[::ffff:0.0.0.0]"}) {
    std::string why;
    EXPECT_FALSE(net::split_endpoint(std::string(host) + ":12810", &why)) << host;
    EXPECT_THAT(why, testing::HasSubstr("means all addresses of this machine")) << host;
  }
  EXPECT_THAT(net::listen_error("0", 1), testing::HasSubstr("means all addresses"));
}

}  // namespace
}  // namespace corbot::client
