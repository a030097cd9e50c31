// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace corbot::sim {

/// Faults of a controller that concern the answers to one kind of query, the others being answered as ever. A
/// person asks for them by name.
class AnswerFaults {
 public:
  /// The kinds of queries that the device answers.
  AnswerFaults(std::initializer_list<const char*> queries);

  /// Takes from an answer what the faults take. How much later it leaves.
  std::int64_t apply(std::string_view query, std::vector<std::uint8_t>& answer);

  /// `deaf|garble|half QUERY on|off`, `lose QUERY N`, `delay QUERY MS`. Nothing where the words are no such
  /// command; else what is wrong with it, empty: nothing.
  std::optional<std::string> execute(const std::vector<std::string_view>& words);

 private:
  struct Fault {
    bool is_deaf{false};
    bool is_garbled{false};
    bool is_halved{false};
    std::uint64_t lost_every{0};  ///< 0: none
    std::uint64_t delay_ms{0};
    std::uint64_t answers{0};  ///< so far
  };

  std::map<std::string, Fault, std::less<>> faults_;
};

}  // namespace corbot::sim
