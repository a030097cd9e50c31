// SPDX-License-Identifier: Apache-2.0
#include "panel/call_request.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "client/explain.h"
#include "client/failure.h"

namespace corbot::panel {

namespace {

using client::ExitCode;
using client::Failure;
using nlohmann::json;

/// As idl/cell.idl allows.
constexpr std::size_t kMostPlaceBytes = 32;
constexpr std::uint64_t kMostSlot = std::numeric_limits<std::int32_t>::max();
/// A page's number is exact up to here.
constexpr std::uint64_t kMostPieceNumber = (std::uint64_t{1} << 53) - 1;

/// A value in the body: a number, or a list of numbers.
struct Field {
  std::string_view key;
  std::size_t numbers;        ///< 0: a number; else the largest length of the list
  std::string_view option{};  ///< of the command line; empty: a required argument
  bool is_of_any_length{false};
};

struct Action {
  std::string_view word;  ///< as on the command line
  std::vector<Field> fields{};
};

const std::vector<Action>& actions() {
  static const Field to{"to_m", 3};
  static const Field above{"above_m", 0, "--above"};
  static const Field time{"time_s", 0, "--time"};
  static const Field percent{"percent", 0};
  static const std::vector<Action> all{{"ready"},
                                       {"open"},
                                       {"close"},
                                       {"gripper", {percent}},
                                       {"move", {to, above, time}},
                                       {"moves", {to, above, time}},
                                       {"joints", {{"joints", 6, "", true}, time}},
                                       {"speed", {percent}},
                                       {"override", {percent}},
                                       {"pause"},
                                       {"resume"},
                                       {"clear"},
                                       {"acquire", {{"lease_s", 0, "--lease"}}},
                                       {"renew"},
                                       {"release"}};
  return all;
}

[[noreturn]] void refuse(const std::string& text) { throw Failure(ExitCode::kUsage, text); }

const Action& action_of(const json& body) {
  const auto wanted = body.find("do");
  std::vector<std::string_view> words;
  for (const Action& action : actions()) {
    if (wanted != body.end() && *wanted == action.word) return action;
    words.push_back(action.word);
  }
  const std::string given =
      wanted == body.end() ? "is missing" : client::printable(wanted->dump(-1, ' ', true)) + " is unknown";
  refuse(fmt::format("do: {}; there are: {}", given, fmt::join(words, ", ")));
}

void add_number(const Field& field, const json& value, std::vector<std::string>& words) {
  if (!value.is_number()) refuse(fmt::format("{}: must have numbers alone", field.key));
  words.push_back(fmt::format("{}", value.get<double>()));
}

/// Adds the words of the command line that give the field.
void add_words(const Field& field, const json& value, std::vector<std::string>& words) {
  if (!field.option.empty()) words.emplace_back(field.option);
  if (field.numbers == 0) return add_number(field, value, words);
  const bool is_right = value.is_array() && !value.empty() && value.size() <= field.numbers &&
                        (field.is_of_any_length || value.size() == field.numbers);
  if (!is_right)
    refuse(fmt::format("{}: must be a list of {}{} numbers", field.key, field.is_of_any_length ? "1 to " : "",
                       field.numbers));
  for (const json& number : value) add_number(field, number, words);
}

void check_keys(const Action& action, const json& body) {
  for (const auto& [key, value] : body.items()) {
    const auto is_field = [&, &name = key](const Field& field) { return field.key == name; };
    if (key != "robot" && key != "do" && std::none_of(action.fields.begin(), action.fields.end(), is_field))
      refuse(fmt::format("{}: '{}' has no such value", client::printable(key), action.word));
  }
}

/// Begins a request of a cell that has no values but those.
CellRequest of_cell(CellAction action, const json& body, std::initializer_list<std::string_view> allowed) {
  for (const auto& [key, value] : body.items()) {
    if (key == "cell" || key == "do") continue;
    if (std::find(allowed.begin(), allowed.end(), key) == allowed.end())
      refuse(fmt::format("{}: this order of a cell has no such value", client::printable(key)));
  }
  return {.action = action};
}

std::string place_of(const json& body) {
  const auto value = body.find("place");
  if (value == body.end() || !value->is_string()) refuse("place: must be a text, the name of a place");
  auto place = value->get<std::string>();
  if (place.empty() || place.size() > kMostPlaceBytes)
    refuse(fmt::format("place: has {} bytes: must have 1 to {}", place.size(), kMostPlaceBytes));
  return place;
}

std::uint64_t whole_number(const json& body, const char* key, std::uint64_t least, std::uint64_t most) {
  const auto value = body.find(key);
  if (value == body.end()) refuse(fmt::format("{}: is missing", key));
  if (!value->is_number_unsigned() || *value < least || *value > most)
    refuse(fmt::format("{}: {}: must be a whole number from {} to {}", key,
                       client::printable(value->dump(-1, ' ', true)), least, most));
  return value->get<std::uint64_t>();
}

CellRequest resolve_request(const json& body) {
  CellRequest request = of_cell(CellAction::kResolve, body, {"piece", "place", "slot", "gone"});
  request.piece = whole_number(body, "piece", 1, kMostPieceNumber);
  const bool is_gone = body.contains("gone");
  if (is_gone == body.contains("place") || (is_gone && (body.at("gone") != true || body.contains("slot"))))
    refuse("resolve: say where the piece stands, by 'place' and 'slot', or \"gone\": true");
  if (is_gone) return request;
  request.place = place_of(body);
  if (body.contains("slot"))
    request.slot = static_cast<std::int32_t>(whole_number(body, "slot", 0, kMostSlot));
  return request;
}

}  // namespace

client::Request call_request(const json& body) {
  if (!body.is_object()) refuse("write an object: {\"robot\": NAME, \"do\": \"ready\"}");
  const Action& action = action_of(body);
  check_keys(action, body);
  std::vector<std::string> words{std::string(action.word)};
  for (const Field& field : action.fields) {
    const auto value = body.find(field.key);
    if (value != body.end())
      add_words(field, *value, words);
    else if (field.option.empty())
      refuse(fmt::format("{}: is missing: '{}' needs it", field.key, action.word));
  }
  const auto parsed = client::parse_request(words);
  if (const auto* fault = std::get_if<std::string>(&parsed))
    refuse(fmt::format("{}: {}", action.word, *fault));
  return std::get<client::Request>(parsed);
}

CellRequest cell_request(const json& body) {
  const json wanted = body.value("do", json());
  if (wanted == "start") return of_cell(CellAction::kStart, body, {});
  if (wanted == "pause") return of_cell(CellAction::kPause, body, {});
  if (wanted == "exchange") {
    CellRequest request = of_cell(CellAction::kExchange, body, {"place"});
    request.place = place_of(body);
    return request;
  }
  if (wanted == "resolve") return resolve_request(body);
  refuse("do: a cell has 'start', 'pause', 'resolve' and 'exchange'; POST /api/stop stops it");
}

}  // namespace corbot::panel
