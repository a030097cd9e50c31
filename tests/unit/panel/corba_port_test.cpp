// SPDX-License-Identifier: Apache-2.0
#include "panel/corba_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "client/failure.h"
#include "support/ports.h"

namespace corbot::panel {
namespace {

using testing::HasSubstr;

// The page shows these texts to people who have started `corbot panel`.
TEST(PanelCorbaPort, SaysHowToNameARobotAtThePanel) {
  // Robots that are up in the user's own directory would be named instead.
  std::string directory = testing::TempDir() + "corbot-port-XXXXXX";
  ASSERT_NE(::mkdtemp(directory.data()), nullptr);
  ::setenv("XDG_RUNTIME_DIR", directory.c_str(), 1);
  const CORBA::ORB_var orb = start_panel_orb();
  const std::string nowhere = "127.0.0.1:" + std::to_string(test::free_port()) + "/none";
  for (const std::string& robot : {std::string("not-up"), nowhere, std::string("no name")}) {
    CorbaPort port(orb.in(), robot);
    try {
      (void)port.connect();
      ADD_FAILURE() << robot;
    } catch (const client::Failure& failure) {
      EXPECT_THAT(failure.what(), HasSubstr("corbot panel "));
      EXPECT_THAT(failure.what(), testing::Not(HasSubstr("--robot")));
    }
  }
  orb->destroy();
  ::unsetenv("XDG_RUNTIME_DIR");
  std::filesystem::remove_all(directory);
}

}  // namespace
}  // namespace corbot::panel
