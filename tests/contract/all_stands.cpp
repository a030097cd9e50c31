// SPDX-License-Identifier: Apache-2.0
#include <ostream>

#include "contract/stand.h"

namespace corbot::test {

void PrintTo(const StandKind& kind, std::ostream* out) { *out << kind.name; }

std::vector<StandKind> outside_stands() { return serial_stands(); }

std::vector<StandKind> all_stands() {
  std::vector<StandKind> all = loopback_stands();
  const std::vector<StandKind> outside = outside_stands();
  all.insert(all.end(), outside.begin(), outside.end());
  return all;
}

}  // namespace corbot::test
