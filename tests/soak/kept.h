// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <istream>
#include <string>

#include "soak/evidence.h"

namespace corbot::soak {

// A file with all that the judge reads, so that a run can be judged again. The first word of a line tells its
// kind:
// `0 ROW`: a row of `corbot record`;
// `N REPORT`: a line that client N printed;
// `c REPORT`: a call that the soak made by a command;
// `! KIND BEGIN END ...`: breaks, stalls, clears and announced restarts, at the end of the file;
// `# TEXT`: a remark for a reader.

using WriteLine = std::function<void(const std::string& line)>;

void write_circumstances(const Evidence& evidence, const WriteLine& write);

/// The contents of such a file.
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
