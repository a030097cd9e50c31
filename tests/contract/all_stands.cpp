// SPDX-License-Identifier: Apache-2.0
#include <ostream>

#include "contract/stand.h"

namespace corbot::test {

void PrintTo(const StandKind& kind, std::ostream* out) { *out << kind.name; }

std::vector<StandKind> all_stands() {
  std::vector<StandKind> all;
  for (const auto& stands : {loopback_stands(), serial_stands()}) {
    all.insert(all.end(), stands.begin(), stands.end());
  }
  return all;
}

}  // namespace corbot::test
