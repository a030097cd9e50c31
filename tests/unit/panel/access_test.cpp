// SPDX-License-Identifier: Apache-2.0
#include "panel/access.h"

#include <gtest/gtest.h>

namespace corbot::panel {
namespace {

TEST(Access, TakesNamesOfTheLoopbackAndThoseThatAreGiven) {
  for (const char* host : {"localhost", "LocalHost:8080", "127.0.0.1:1", "[::1]", "[::1]:8080"})
    EXPECT_TRUE(is_host_allowed(host, {})) << host;
  for (const char* host :
       {"", ":80", "example.org", "localhost.example.org", "127.0.0.1.example.org", "127.0.0.2",
        "localhost:80a", "localhost:80:80", "user@localhost", "::1", "[::1", "cell.example:80"})
    EXPECT_FALSE(is_host_allowed(host, {})) << host;
  EXPECT_TRUE(is_host_allowed("cell.example:80", {"cell.example"}));
  EXPECT_FALSE(is_host_allowed("other.example", {"cell.example"}));
}

TEST(Access, AnOriginIsTheHostOfTheRequest) {
  EXPECT_TRUE(is_same_origin("http://localhost:8080", "LOCALHOST:8080"));
  EXPECT_TRUE(is_same_origin("https://cell.example", "cell.example"));
  for (const char* origin : {"", "null", "http://localhost", "http://localhost:3000", "http://example.org",
                             "http://localhost:8080.example.org", "file://localhost:8080", "localhost:8080"})
    EXPECT_FALSE(is_same_origin(origin, "localhost:8080")) << origin;
}

TEST(Access, ATokenIsWholeAndNotEmpty) {
  EXPECT_TRUE(is_token("abc", "abc"));
  for (const char* given : {"", "ab", "abd", "abcd", "ABC"}) EXPECT_FALSE(is_token(given, "abc")) << given;
  EXPECT_FALSE(is_token("", ""));
}

TEST(Access, FindsTheTokenOfAHeader) {
  for (const char* header : {"Bearer aBc", "bearer aBc", "BEARER aBc"})
    EXPECT_EQ(bearer_token(header), "aBc");
  for (const char* header : {"", "Bearer", "Bearer ", "Basic aBc", "BeareraBc", " Bearer aBc"})
    EXPECT_EQ(bearer_token(header), "") << header;
}

TEST(Access, FindsAValueOfAQuery) {
  EXPECT_EQ(query_value("/ws?token=abc", "token"), "abc");
  EXPECT_EQ(query_value("/ws?a=1&token=abc&b=2", "token"), "abc");
  for (const char* target : {"/ws", "/ws?", "/ws?token", "/ws?token=", "/ws?xtoken=abc", "/token=abc"})
    EXPECT_EQ(query_value(target, "token"), "") << target;
}

}  // namespace
}  // namespace corbot::panel
