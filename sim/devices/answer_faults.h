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

/// The faults of a controller's answers to one kind of query; it answers the other kinds as usual. A person
/// names the faults.
class AnswerFaults {
 public:
  /// Takes the kinds of queries that the device answers.
  AnswerFaults(std::initializer_list<const char*> queries);

  /// Applies the faults to an answer. Returns the delay of the answer.
  std::int64_t apply(std::string_view query, std::vector<std::uint8_t>& answer);

  /// Executes `deaf|garble|half QUERY on|off`, `lose QUERY N`, `delay QUERY MS`. Returns nothing if the words
  /// are no such command, else the error, which is empty if there is none.
  std::optional<std::string> execute(const std::vector<std::string_view>& words);

 private:
  struct Fault {
    bool is_deaf{false};
    bool is_garbled{false};
    bool is_halved{false};
    std::uint64_t lost_every{0};  ///< 0: none
    std::uint64_t delay_ms{0};
    std::uint64_t answers{0};  ///< number so far
  };

  std::map<std::string, Fault, std::less<>> faults_;
};

}  // namespace corbot::sim
