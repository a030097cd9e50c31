// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <istream>
#include <string>

#include "soak/evidence.h"

namespace corbot::soak {

// A file with all that the judge reads, so that a run can be judged again. A line each, by its first word:
//   0 ROW                    what `corbot record` printed
//   N REPORT                 what client N printed
//   c REPORT                 of a call that the soak made by a command
//   ! KIND BEGIN END ...     what was broken, stalls, clears, announced restarts: at the end of the file
//   # TEXT                   for a reader

using WriteLine = std::function<void(const std::string& line)>;

void write_circumstances(const Evidence& evidence, const WriteLine& write);

/// What such a file holds.
struct Kept {
  explicit Kept(const Profile& profile) : recording(profile) {}
  void read(std::istream& stream);

  Ledger ledger;
  Recording recording;
  std::vector<Break> breaks;
  std::vector<Interval> stalls;
  std::vector<Clear> clears;
  std::vector<Restart> restarts;
};

}  // namespace corbot::soak
