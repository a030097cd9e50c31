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
#include "panel/fake_port.h"

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

std::string read_of_cell(const std::string& body) {
  try {
    return text_of(cell_request(json::parse(body)));
  } catch (const client::Failure& failure) {
    EXPECT_EQ(failure.code(), client::ExitCode::kUsage);
    return std::string("FAULT ") + failure.what();
  }
}

TEST(CellRequest, IsAnOrderOrAPersonsWord) {
  const std::vector<std::pair<const char*, const char*>> cases{
      {R"({"cell": "one", "do": "start"})", "start"},
      {R"({"do": "pause"})", "pause"},
      {R"({"do": "exchange", "place": "pallet2"})", "exchange pallet2"},
      {R"({"do": "resolve", "piece": 4, "gone": true})", "resolve 4  -1"},
      {R"({"do": "resolve", "piece": 4, "place": "store1"})", "resolve 4 store1 -1"},
      {R"({"do": "resolve", "piece": 9007199254740991, "place": "p", "slot": 2147483647})",
       "resolve 9007199254740991 p 2147483647"}};
  for (const auto& [body, order] : cases) EXPECT_EQ(read_of_cell(body), order) << body;
}

TEST(CellRequest, SaysWhatIsWrong) {
  const std::vector<std::pair<const char*, const char*>> cases{
      {R"({"do": "stop"})", "do: a cell has 'start', 'pause', 'resolve' and 'exchange'"},
      {R"({"do": "start", "piece": 4})", "piece: this order of a cell has no such value"},
      {R"({"do": "exchange"})", "place: must be a text"},
      {R"({"do": "exchange", "place": 7})", "place: must be a text"},
      {R"({"do": "exchange", "place": ""})", "place: has 0 bytes: must have 1 to 32"},
      {R"({"do": "exchange", "place": "abcdefghijklmnopqrstuvwxyz0123456"})", "place: has 33 bytes"},
      {R"({"do": "exchange", "place": "p", "slot": 0})", "slot: this order of a cell has no such value"},
      {R"({"do": "resolve", "gone": true})", "piece: is missing"},
      {R"({"do": "resolve", "piece": 0, "gone": true})",
       "piece: 0: must be a whole number from 1 to 9007199254740991"},
      {R"({"do": "resolve", "piece": -1, "gone": true})", "piece: -1: must be a whole number"},
      {R"({"do": "resolve", "piece": 1.5, "gone": true})", "piece: 1.5: must be a whole number"},
      {R"({"do": "resolve", "piece": "4", "gone": true})", "piece: \"4\": must be a whole number"},
      {R"({"do": "resolve", "piece": 4})", "resolve: say where the piece stands"},
      {R"({"do": "resolve", "piece": 4, "gone": false})", "resolve: say where the piece stands"},
      {R"({"do": "resolve", "piece": 4, "gone": true, "place": "p"})", "resolve: say where the piece stands"},
      {R"({"do": "resolve", "piece": 4, "gone": true, "slot": 1})", "resolve: say where the piece stands"},
      {R"({"do": "resolve", "piece": 4, "place": "p", "slot": 2147483648})",
       "slot: 2147483648: must be a whole number from 0 to 2147483647"},
      {R"({"do": "resolve", "piece": 4, "place": "p", "slot": -1})", "slot: -1: must be a whole number"}};
  for (const auto& [body, fault] : cases) EXPECT_THAT(read_of_cell(body), HasSubstr(fault)) << body;
}

}  // namespace
}  // namespace corbot::panel
