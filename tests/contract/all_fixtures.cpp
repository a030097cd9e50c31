// SPDX-License-Identifier: Apache-2.0
#include <ostream>

#include "contract/device_fixture.h"
#include "rt/backends/registry.h"

namespace corbot::test {

std::unique_ptr<Backend> DeviceFixture::make(const Profile& profile, EmergencyStop& stop) {
  return rt::make_backend(profile, stop);
}

void PrintTo(const DeviceFixtureKind& kind, std::ostream* out) { *out << kind.name; }

std::vector<DeviceFixtureKind> outside_fixtures() {
  std::vector<DeviceFixtureKind> all = serial_fixtures();
  for (const auto& more : {can_fixtures(), kernel_fixtures()})
    all.insert(all.end(), more.begin(), more.end());
  return all;
}

std::vector<DeviceFixtureKind> all_fixtures() {
  std::vector<DeviceFixtureKind> all = loopback_fixtures();
  for (const auto& more : {pulse_fixtures(), outside_fixtures()})
    all.insert(all.end(), more.begin(), more.end());
  return all;
}

}  // namespace corbot::test
