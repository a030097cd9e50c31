// SPDX-License-Identifier: Apache-2.0
#include <ostream>

#include "contract/device_fixture.h"
#include "rt/backends/registry.h"

namespace corbot::test {

std::unique_ptr<Backend> Stand::make(const Profile& profile, EmergencyStop& stop) {
  return rt::make_backend(profile, stop);
}

void PrintTo(const StandKind& kind, std::ostream* out) { *out << kind.name; }

std::vector<StandKind> outside_stands() {
  std::vector<StandKind> all = serial_stands();
  for (const auto& more : {can_stands(), kernel_stands()}) all.insert(all.end(), more.begin(), more.end());
  return all;
}

std::vector<StandKind> all_stands() {
  std::vector<StandKind> all = loopback_stands();
  for (const auto& more : {pulse_stands(), outside_stands()}) all.insert(all.end(), more.begin(), more.end());
  return all;
}

}  // namespace corbot::test
