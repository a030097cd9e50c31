// SPDX-License-Identifier: Apache-2.0
// Tests the parts that only the servant on ORBit2 has: its refusals, its Unix socket.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <signal.h>

#include <filesystem>
#include <fstream>

#include <fmt/core.h>

#include "support/naming_service.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
namespace fs = std::filesystem;

const std::string kServant = CORBOT_BIN_DIR "/corbot-servant-orbit2";

class Orbit2Servant : public RobotRig {
 protected:
  void SetUp() override {
    if (!fs::exists(kServant)) GTEST_SKIP() << "skipped: ORBit2 not found";
    take_name("orbit2");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
    fs::permissions(directory_, fs::perms::owner_all);
    start_rt();
  }
  void TearDown() override {
    if (!rt_) return;
    RobotRig::TearDown();
    fs::remove_all(directory_);
  }
  void serve(const std::vector<std::string>& more, const std::vector<std::string>& environment = {}) {
    std::vector<std::string> command{kServant, profile_, "--name", name_};
    command.insert(command.end(), more.begin(), more.end());
    servant_ = std::make_unique<Process>(command, environment);
    const auto line = servant_->wait_line("ready ", within(30));
    ASSERT_TRUE(line) << servant_->errors();
    ready_ = line->substr(6);
  }
  std::string endpoint() const { return fmt::format("127.0.0.1:{}", port_); }
  RunResult refused(const std::vector<std::string>& more) {
    std::vector<std::string> command{kServant, profile_, "--name", name_};
    command.insert(command.end(), more.begin(), more.end());
    return run(command);
  }
  /// One command to the C client, connected to the reference.
  std::string ask_in_c(const std::string& reference, const std::string& command) {
    Process client({CORBOT_TESTS_DIR "/client_orbit2"}, {"ORBIT_SOCKETDIR=" + directory_});
    client.send("connect " + reference);
    const auto connected = client.wait_line("", within(30));
    if (connected != "ok") return connected.value_or("no answer");
    client.send(command);
    return client.wait_line("", within(30)).value_or("no answer");
  }

  std::string directory_;
  std::string ready_;
};

TEST_F(Orbit2Servant, ListensNowhereButOnTheLoopbackInterfaceUnlessUnsafeIsAllowed) {
  const std::string elsewhere = fmt::format("192.0.2.1:{}", port_);
  const RunResult result = refused({"--endpoint", elsewhere});
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.errors, HasSubstr("will not listen on 192.0.2.1"));
  EXPECT_THAT(result.errors, HasSubstr("--i-know-orbit2-is-unsafe"));
  const RunResult known = refused({"--endpoint", elsewhere, "--i-know-orbit2-is-unsafe"});
  EXPECT_EQ(known.code, 1);
  EXPECT_THAT(known.errors, HasSubstr("anyone who reaches it can move the robot"));
  EXPECT_THAT(known.errors, HasSubstr("'192.0.2.1' is not an address of this machine"));
}

TEST_F(Orbit2Servant, ListensOnAnAddressOfTheMachineWhenUnsafeIsAllowed) {
  ifaddrs* all = nullptr;
  ASSERT_EQ(::getifaddrs(&all), 0);
  char host[INET_ADDRSTRLEN] = "";
  for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
    const auto& address = reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr;
    if (ntohl(address.s_addr) >> 24 != IN_LOOPBACKNET) ::inet_ntop(AF_INET, &address, host, sizeof(host));
  }
  ::freeifaddrs(all);
  if (*host == '\0') GTEST_SKIP() << "skipped: this machine has the loopback interface only";
  serve({"--endpoint", fmt::format("{}:{}", host, port_), "--i-know-orbit2-is-unsafe"});
  if (HasFatalFailure()) return;
  EXPECT_EQ(ready_, fmt::format("corbaloc::{}:{}/{}", host, port_, name_));
  EXPECT_EQ(connect(ready_)->DoF(), 4);
}

TEST_F(Orbit2Servant, ReadsNoOrbitrc) {
  std::ofstream(directory_ + "/.orbitrc") << "ORBNamingIOR=nonsense\n";  // it would be reported
  serve({"--endpoint", endpoint()}, {"HOME=" + directory_});
  if (HasFatalFailure()) return;
  EXPECT_EQ(connect()->DoF(), 4);
  EXPECT_EQ(servant_->errors().find("nonsense"), std::string::npos) << servant_->errors();
}

TEST_F(Orbit2Servant, TakesNoOptionThatOpensAnotherAddress) {
  for (const char* option :
       {"--ORBIIOPIPName=0.0.0.0", "-ORBIIOPIPSock=1", "--ORBIIOPIPv6=1", "--ORBNetID=fqdn"}) {
    const RunResult result = refused({"--endpoint", endpoint(), option});
    EXPECT_EQ(result.code, 2) << option;
    EXPECT_THAT(result.errors, HasSubstr("is set by --endpoint and --unix")) << option;
  }
  EXPECT_EQ(refused({"--unix", directory_ + "/s", "--endpoint", endpoint()}).code, 2);
  EXPECT_EQ(refused({"--unix", directory_ + "/s", "--naming", "corbaloc::127.0.0.1:1/NameService"}).code, 2);
  EXPECT_EQ(refused({"--unix", "relative"}).code, 2);
  EXPECT_EQ(refused({"--unix", "/" + std::string(200, 'x')}).code, 2);
}

TEST_F(Orbit2Servant, ServesOnAUnixSocket) {
  const std::string path = directory_ + "/arm";
  serve({"--unix", path});
  if (HasFatalFailure()) return;
  EXPECT_EQ(ready_, fmt::format("corbaloc:uiop:{}:/{}", path, name_));
  EXPECT_EQ(ask_in_c(ready_, "get DoF"), "ok 4");
  EXPECT_EQ(ask_in_c(ready_, "call Ready"), "ok");
  const std::string control = ask_in_c(ready_, "call Acquire here 600");
  ASSERT_THAT(control, StartsWith("ok IOR:"));
  EXPECT_EQ(ask_in_c(control.substr(3), "call Ready"), "ok");
  EXPECT_THAT(ask_in_c(ready_, "call Ready"), StartsWith("exception NotReady"));
  EXPECT_EQ(ask_in_c(control.substr(3), "call Release"), "ok");
  const RunResult second = run({kServant, profile_, "--name", name_ + "b", "--unix", path});
  EXPECT_EQ(second.code, 1);
  EXPECT_THAT(second.errors, HasSubstr("in use by another program"));
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(30)));
  EXPECT_TRUE(fs::exists(path)) << "what a killed one leaves";
  serve({"--unix", path});
  if (HasFatalFailure()) return;
  EXPECT_EQ(ask_in_c(ready_, "get DoF"), "ok 4");
  EXPECT_EQ(servant_->terminate(), 0);
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(Orbit2Servant, LogsAReferenceThatNeedsNoCorbaloc) {
  serve({"--endpoint", endpoint()});
  if (HasFatalFailure()) return;
  const std::size_t at = servant_->errors().find("IOR:");
  ASSERT_NE(at, std::string::npos) << servant_->errors();
  const std::string ior = servant_->errors().substr(at, servant_->errors().find('\n', at) - at);
  EXPECT_EQ(ask_in_c(ior, "get DoF"), "ok 4");
  EXPECT_EQ(connect(ior)->DoF(), 4);
}

TEST_F(Orbit2Servant, TakesAnyFormOfReferenceToANamingService) {
  NamingService service;
  const std::string address = service.reference().substr(std::string("corbaloc::").size());
  CORBA::Object_var root = client_orb()->string_to_object(service.reference().c_str());
  CORBA::Object_var narrowed = CosNaming::NamingContext::_narrow(root);
  const CORBA::String_var ior = client_orb()->object_to_string(narrowed);
  for (const std::string& reference : {"corbaloc::" + address, "corbaloc:iiop:1.2@" + address,
                                       "corbaloc::1.0@" + address, std::string(ior)}) {
    serve({"--endpoint", endpoint(), "--naming", reference});
    if (HasFatalFailure()) return;
    EXPECT_TRUE(wait_until(within(30), [&] { return service.knows(name_); }))
        << reference << servant_->errors();
    EXPECT_EQ(servant_->terminate(), 0);
    EXPECT_FALSE(service.knows(name_)) << reference;
  }
  for (const char* nonsense :
       {"", "NameService", "corbaloc::", "corbaloc::127.0.0.1:1", "corbaloc::127.0.0.1:1/",
        "corbaloc::127.0.0.1:99999/NameService", "corbaloc:rir:/NameService"}) {
    EXPECT_EQ(refused({"--endpoint", endpoint(), "--naming", nonsense}).code, 2) << nonsense;
  }
}

TEST_F(Orbit2Servant, LeavesNothingUnderTmp) {
  serve({"--endpoint", endpoint()}, {"TMPDIR=" + directory_});
  if (HasFatalFailure()) return;
  EXPECT_TRUE(fs::is_empty(directory_)) << *fs::directory_iterator(directory_);
}

}  // namespace
}  // namespace corbot::test
