// SPDX-License-Identifier: Apache-2.0
// The scenario with arms of all kinds: each client with each arm, and each of both with both ORBs.
#include <cstdlib>
#include <filesystem>

#include <fmt/core.h>

#include "interop/scenario.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

struct Pairing {
  ClientKind client;
  std::string arm;
  bool on_orbit2;
};
std::string name_of(const Pairing& pairing) {
  return fmt::format("{}_{}{}", pairing.arm, pairing.client.name, pairing.on_orbit2 ? "_on_orbit2" : "");
}
void PrintTo(const Pairing& pairing, std::ostream* out) { *out << name_of(pairing); }

/// Every client with every arm once. By turns with either ORB, so that each client and each arm has both.
std::vector<Pairing> pairings() {
  std::vector<Pairing> all;
  bool on_orbit2 = false;
  for (const char* arm :
       {"al5d_wr", "puma560", "scara_gx4", "cartesian_ppp", "cylindrical_rpp", "polar_rrp", "turntable"}) {
    bool turn = on_orbit2;
    for (const ClientKind& client : client_kinds()) {
      all.push_back({client, arm, turn});
      turn = !turn;
    }
    on_orbit2 = !on_orbit2;
  }
  return all;
}

class ArmsMatrix : public Scenario, public ::testing::WithParamInterface<Pairing> {};

TEST_P(ArmsMatrix, SeesWhatTheScenarioSays) {
  if (GetParam().on_orbit2) {
    if (!std::filesystem::exists(CORBOT_BIN_DIR "/corbot-servant-orbit2"))
      GTEST_SKIP() << "skipped: ORBit2 not found";
    ::setenv("CORBOT_TEST_ORB", "orbit2", 1);
  } else {
    ::unsetenv("CORBOT_TEST_ORB");
  }
  begin(GetParam().client, GetParam().arm);
  if (HasFatalFailure() || IsSkipped()) return;
  run();
  EXPECT_GT(steps_, 40) << "the scenario was not found, or is cut";
}

INSTANTIATE_TEST_SUITE_P(Pairwise, ArmsMatrix, ::testing::ValuesIn(pairings()),
                         [](const auto& test) { return name_of(test.param); });

}  // namespace
}  // namespace corbot::test
