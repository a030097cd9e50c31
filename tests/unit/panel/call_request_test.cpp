// SPDX-License-Identifier: Apache-2.0
#include "panel/call_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "client/failure.h"

namespace corbot::panel {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string read(const std::string& body) {
  try {
    return client::to_string(call_request(json::parse(body)));
  } catch (const client::Failure& failure) {
    EXPECT_EQ(failure.code(), client::ExitCode::kUsage);
    return std::string("FAULT ") + failure.what();
  }
}

TEST(CallRequest, IsTheCommandOfTheCommandLine) {
  const std::vector<std::pair<const char*, const char*>> cases{
      {R"({"robot": "one", "do": "ready"})", "ready"},
      {R"({"do": "open"})", "open"},
      {R"({"do": "close"})", "close"},
      {R"({"do": "clear"})", "clear"},
      {R"({"do": "pause"})", "pause"},
      {R"({"do": "resume"})", "resume"},
      {R"({"do": "renew"})", "renew"},
      {R"({"do": "release"})", "release"},
      {R"({"do": "gripper", "percent": 12.5})", "gripper 12.5"},
      {R"({"do": "speed", "percent": 30})", "speed 30"},
      {R"({"do": "override", "percent": 100})", "override 100"},
      {R"({"do": "move", "to_m": [0.2, -0.1, 1e-7]})", "move 0.2 -0.1 1e-07"},
      {R"({"do": "move", "to_m": [0, 0, 0], "time_s": 3, "above_m": 0.02})",
       "move 0 0 0 --above 0.02 --time 3"},
      {R"({"do": "moves", "to_m": [1, 2, 3]})", "moves 1 2 3"},
      {R"({"do": "joints", "joints": [-10, 20], "time_s": 1})", "joints -10 20 --time 1"},
      {R"({"do": "acquire", "lease_s": 5})", "acquire --lease 5"}};
  for (const auto& [body, command] : cases) EXPECT_EQ(read(body), command) << body;
}

TEST(CallRequest, SaysWhatIsWrong) {
  const std::vector<std::pair<const char*, const char*>> cases{
      {"[]", "write an object"},
      {"{}", "do: is missing; there are: ready, open"},
      {R"({"do": "stop"})", "do: \"stop\" is unknown"},
      {R"({"do": 7})", "do: 7 is unknown"},
      {R"({"do": "ready", "to_m": [0, 0, 0]})", "to_m: 'ready' has no such value"},
      {R"({"do": "move"})", "to_m: is missing: 'move' needs it"},
      {R"({"do": "move", "to_m": [0, 0]})", "to_m: must be a list of 3 numbers"},
      {R"({"do": "move", "to_m": 3})", "to_m: must be a list of 3 numbers"},
      {R"({"do": "move", "to_m": [0, 0, "1"]})", "to_m: must have numbers alone"},
      {R"({"do": "move", "to_m": [0, 0, null]})", "to_m: must have numbers alone"},
      {R"({"do": "move", "to_m": [0, 0, 0], "time_s": -1})", "move: --time -1: must not be negative"},
      {R"({"do": "joints", "joints": []})", "joints: must be a list of 1 to 6 numbers"},
      {R"({"do": "joints", "joints": [1, 2, 3, 4, 5, 6, 7]})", "joints: must be a list of 1 to 6 numbers"},
      {R"({"do": "gripper", "percent": 101})", "gripper: PERCENT 101: must be 0 to 100"},
      {R"({"do": "override", "percent": 0})", "override: PERCENT 0: must be above 0 and at most 100"},
      {R"({"do": "acquire", "lease_s": 0.1})", "acquire: --lease 0.1: must be 0.5 to 3600"}};
  for (const auto& [body, fault] : cases) EXPECT_THAT(read(body), HasSubstr(fault)) << body;
  EXPECT_THROW((void)call_request(json{{"do", "speed"}, {"percent", INFINITY}}), client::Failure);
}

}  // namespace
}  // namespace corbot::panel
