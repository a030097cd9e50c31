// SPDX-License-Identifier: Apache-2.0
// Garbage on the port, under `corbot up`: where an ORB cannot bear it, the servant is started again, and the
// real-time task holds the arm or ends its motion meanwhile.
#include <gmock/gmock.h>

#include <random>

#include <fmt/core.h>

#include "cli/cli_rig.h"
#include "support/cases.h"
#include "support/giop.h"

namespace corbot::test {
namespace {

class Garbage : public CliRig {
 protected:
  void SetUp() override {
    up();
    task_ = pid_of("rt_pid");
  }
  pid_t pid_of(const char* key) { return state().at(key).get<pid_t>(); }
  bool answers() {
    return wait_until(within(30), [&] { return !status().empty(); });
  }
  /// Returns the joints at which the real-time task has the arm.
  nlohmann::json joints() { return status().at("joints"); }

  pid_t task_ = 0;
};

/// GIOP 1.2: where is the object, addressed in a way that ORBit2 does not know. It ends the process.
std::string fatal_to_orbit2() {
  constexpr std::uint8_t kLocateRequest = 3;
  const std::string body("\1\0\0\0\7\0", 6);  // number of the request, kind of address
  return giop_header(kLocateRequest, body.size(), false, 2) + body;
}

TEST_F(Garbage, AMessageThatEndsTheServantDoesNotEndTheMotion) {
  const pid_t servant = pid_of("servant_pid");
  auto move = begin({"move", "0.20", "0.10", "0.10", "--time", "3"});
  ASSERT_TRUE(wait_state("Waiting"));
  RawConnection rude(port_);
  ASSERT_TRUE(rude.send(fatal_to_orbit2()));
  ASSERT_TRUE(rude.closed(within(10)));
  if (on_orbit2()) {
    ASSERT_TRUE(wait_until(within(30), [&] {
      return supervisor_->running() && supervisor_->errors().find("servant restarted") != std::string::npos;
    })) << supervisor_->errors();
  }
  ASSERT_TRUE(answers());
  ASSERT_TRUE(wait_state("Standby"));
  const auto tool = status().at("tool");
  EXPECT_NEAR(tool.at("y_m").get<double>(), 0.10, 1e-6) << "the motion was carried out";
  EXPECT_EQ(pid_of("rt_pid"), task_);
  EXPECT_EQ(pid_of("servant_pid") == servant, !on_orbit2());
  EXPECT_EQ(corbot({"ready"}).code, 0);
}

TEST_F(Garbage, OfManyKindsLeavesARobotThatWorks) {
  std::mt19937_64 random(test::drawn_seed());
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const auto noise = [&](std::size_t length) {
    std::string bytes(length, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    return bytes;
  };
  const auto before = joints();
  constexpr int kMessages = 600;
  for (int i = 0; i < kMessages; ++i) {
    RawConnection rude(port_);
    if (!rude.connected()) {  // between a servant's end and the next one's start
      ASSERT_TRUE(answers());
      continue;
    }
    switch (below(4)) {
      case 0:
        rude.send(noise(below(300)));
        break;
      case 1: {
        const std::string body = noise(below(300));
        rude.send(giop_header(static_cast<std::uint8_t>(below(8)), body.size(), below(2) != 0,
                              static_cast<std::uint8_t>(below(3))) +
                  body);
        break;
      }
      case 2: {  // a good request, cut
        const std::string request = giop_request(1, name_, "_get_DoF");
        rude.send(request.substr(0, below(request.size())));
        break;
      }
      default: {  // fragments without end
        const std::string request = giop_request(1, name_, "_get_DoF");
        rude.send(giop_header(0, request.size() - 12, true, 1) + request.substr(12));
        rude.send(giop_header(7, 8, true, 1) + noise(8));
      }
    }
    if (below(8) == 0) (void)rude.reply(within(0.005));
  }
  ASSERT_TRUE(answers()) << supervisor_->errors();
  EXPECT_EQ(joints(), before) << "nothing of it was a motion";
  EXPECT_EQ(pid_of("rt_pid"), task_);
  EXPECT_TRUE(wait_until(within(60), [&] { return corbot({"ready"}).code == 0; })) << supervisor_->errors();
}

}  // namespace
}  // namespace corbot::test
