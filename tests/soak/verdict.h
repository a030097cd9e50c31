// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "soak/evidence.h"

namespace corbot::soak {

struct Verdict {
  /// The answers to one kind of call.
  struct Answers {
    int calls{};
    std::map<std::string, int> outcomes;
    int unanswered{};            ///< by clients that were killed
    double longest_s{};          ///< whatever was broken meanwhile
    double longest_counted_s{};  ///< less what was broken or stood still meanwhile
    double bound_s{};            ///< for that
  };
  std::vector<std::string> faults;
  std::map<std::string, Answers> answers;
  std::map<std::string, int> motions_by_kind;
  int motions{};
  int whole_motions{};  ///< that reached their end, and so name their call
  int paths{};          ///< lines and arcs whose every set-point was compared with what was asked for
  std::map<std::string, int> stops;   ///< by kind: confirmed to their caller
  std::map<std::string, int> clears;  ///< cause and what was broken before -> how many
  int expired{};                      ///< leases that ran out
  double longest_silence_s{};         ///< without a cycle, beyond what was broken and announced
};

Verdict judge(const Evidence& evidence);

}  // namespace corbot::soak
