// SPDX-License-Identifier: Apache-2.0
#include "panel/program_request.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "client/explain.h"
#include "client/failure.h"

namespace corbot::panel {

namespace {

using client::ExitCode;
using client::Failure;
using nlohmann::json;

constexpr std::size_t kMostNameBytes = 100;

std::string text_of(const json& body, const char* key) {
  const auto value = body.find(key);
  if (value == body.end() || !value->is_string())
    throw Failure(ExitCode::kUsage, fmt::format("{}: must be a text", key));
  return value->get<std::string>();
}

}  // namespace

client::Program program_request(const json& body) {
  for (const auto& [key, value] : body.items()) {
    if (key != "robot" && key != "name" && key != "text")
      throw Failure(ExitCode::kUsage, fmt::format("{}: a program has no such value", client::printable(key)));
  }
  const std::string name = client::printable(text_of(body, "name"));
  if (name.empty() || name.size() > kMostNameBytes)
    throw Failure(ExitCode::kUsage,
                  fmt::format("name: has {} bytes: must have 1 to {}", name.size(), kMostNameBytes));
  client::Program program = client::parse_program(text_of(body, "text"));
  program.name = name;
  client::check_program(program);
  return program;
}

}  // namespace corbot::panel
