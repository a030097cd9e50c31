// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/answer_faults.h"

#include "sim/devices/words.h"

namespace corbot::sim {
namespace {

constexpr std::uint64_t kLongestDelay_ms = 60'000;

}  // namespace

AnswerFaults::AnswerFaults(std::initializer_list<const char*> queries) {
  for (const char* query : queries) faults_[query] = {};
}

std::int64_t AnswerFaults::apply(std::string_view query, std::vector<std::uint8_t>& answer) {
  const auto found = faults_.find(query);
  if (found == faults_.end()) return 0;
  Fault& fault = found->second;
  const bool is_lost = fault.lost_every > 0 && ++fault.answers % fault.lost_every == 0;
  if (fault.is_deaf || is_lost) answer.clear();
  if (fault.is_halved) answer.resize(answer.size() / 2);
  for (std::uint8_t& byte : answer) {
    if (fault.is_garbled) byte = static_cast<std::uint8_t>(~byte);
  }
  return static_cast<std::int64_t>(fault.delay_ms) * 1'000'000;
}

std::optional<std::string> AnswerFaults::execute(const std::vector<std::string_view>& words) {
  const std::string_view what = words[0];
  const bool is_switched = what == "deaf" || what == "garble" || what == "half";
  if (!is_switched && what != "lose" && what != "delay") return std::nullopt;
  if (words.size() != 3) return std::nullopt;
  const auto found = faults_.find(words[1]);
  if (found == faults_.end()) {
    std::string known;
    for (const auto& [name, fault] : faults_) known += (known.empty() ? "" : ", ") + name;
    return "the device has no query '" + std::string(words[1]) + "', but " + known;
  }
  Fault& fault = found->second;
  const auto count = count_of(words[2]);
  if (what == "lose" && count) {
    fault.lost_every = *count;
    fault.answers = 0;
  } else if (what == "delay" && count && *count <= kLongestDelay_ms) {
    fault.delay_ms = *count;
  } else if (is_switched && (words[2] == "on" || words[2] == "off")) {
    (what == "deaf" ? fault.is_deaf : what == "half" ? fault.is_halved : fault.is_garbled) = words[2] == "on";
  } else {
    return std::nullopt;
  }
  return std::string();
}

}  // namespace corbot::sim
