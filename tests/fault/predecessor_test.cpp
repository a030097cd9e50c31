// SPDX-License-Identifier: Apache-2.0
// Tests that a real-time task takes the arm's position from the segment of the previous task, and of no older
// one.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "config/load_profile.h"
#include "corbot/channel/fingerprint.h"
#include "shm/channel_client.h"
#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kTakenOver = "takes over from an earlier real-time task";
constexpr const char* kRefused = "but a later task may have run";

class PredecessorOffer : public ::testing::Test {
 protected:
  PredecessorOffer() : name_(unique_name("predecessor")) {
    std::string path = std::string(CORBOT_SCRATCH_DIR) + "/predecessor-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    ::setenv("CORBOT_RUN_DIR", directory_.c_str(), 1);
  }
  ~PredecessorOffer() override {
    task_.reset();
    EXPECT_FALSE(fs::exists(directory_ / (name_ + ".sock")));
    EXPECT_FALSE(fs::exists(directory_ / (name_ + ".last")));
    ::unsetenv("CORBOT_RUN_DIR");
    fs::remove_all(directory_);
  }

  void start(const std::vector<std::string>& environment = {}) {
    task_ = std::make_unique<Process>(std::vector<std::string>{std::string(CORBOT_BIN_DIR) + "/corbot-rt",
                                                               CORBOT_TEST_PROFILE, "--name", name_},
                                      environment);
  }
  void await_ready() { ASSERT_TRUE(task_->wait_line("ready", within(30))) << task_->errors(); }
  void kill() {
    task_->signal(SIGKILL);
    ASSERT_TRUE(task_->wait(within(30)));
  }
  /// A servant that offers that as the last task's segment; the segment that it receives. It stays connected.
  Descriptor serve(const Descriptor& offer) {
    own_ = std::make_unique<Segment<ServantSegment>>(
        Segment<ServantSegment>::create(name_, fingerprint(profile_.arm)));
    EXPECT_TRUE(wait_until(within(30), [&] {
      try {
        connection_ = RunDirectory::open(false)->connect(name_);
        return true;
      } catch (const SegmentError&) {
        return false;  // it does not listen yet
      }
    }));
    Message hello = Message::make(MessageType::kServantHello, name_);
    hello.record.fingerprint = fingerprint(profile_.arm);
    EXPECT_TRUE(send_message(connection_, std::move(hello),
                             {{kCarriesTask, offer.get()}, {kCarriesServant, own_->memory().get()}}));
    Message welcome;
    EXPECT_TRUE(
        wait_until(within(30), [&] { return receive_message(connection_, welcome) != Received::kNothing; }));
    EXPECT_TRUE(send_message(connection_, Message::make(MessageType::kReady, name_)));
    const auto task = Segment<const TaskSegment>::open(
        Descriptor(::fcntl(welcome.task.get(), F_DUPFD_CLOEXEC, 0)), {name_, ::geteuid()});
    EXPECT_TRUE(wait_until(within(30), [&] {
      Snapshot now{};
      return task->snapshot.load(now) && now.incarnation == task->incarnation &&
             now.servant_session == welcome.record.session;
    }));
    return std::move(welcome.task);
  }

  const Profile profile_ = load_profile(CORBOT_TEST_PROFILE);
  const std::string name_;
  fs::path directory_;
  std::unique_ptr<Process> task_;
  std::unique_ptr<Segment<ServantSegment>> own_;
  Descriptor connection_;
};

TEST_F(PredecessorOffer, TheLastIsTakenOverAndAnOlderOneIsNot) {
  start();
  const Descriptor first = serve({});
  kill();
  start();
  const Descriptor second = serve(first);
  await_ready();
  EXPECT_THAT(task_->errors(), HasSubstr(kTakenOver));
  kill();
  start();
  (void)serve(first);  // by a servant that was frozen meanwhile
  await_ready();
  EXPECT_THAT(task_->errors(), HasSubstr(kRefused));
  EXPECT_THAT(task_->errors(), Not(HasSubstr(kTakenOver)));
  connection_ = {};
  EXPECT_EQ(task_->terminate(), 0);
}

TEST_F(PredecessorOffer, ATaskThatNoServantHasSeenDoesNotHideTheOneBefore) {
  start();
  const Descriptor first = serve({});
  kill();
  start();
  await_ready();
  kill();  // nothing could move the arm meanwhile
  start();
  (void)serve(first);
  await_ready();
  EXPECT_THAT(task_->errors(), HasSubstr(kTakenOver));
  connection_ = {};
  EXPECT_EQ(task_->terminate(), 0);
}

TEST_F(PredecessorOffer, WithoutKnowledgeOfTheLastNoneIsTakenOver) {
  start();
  const Descriptor first = serve({});
  kill();
  ASSERT_TRUE(fs::remove(directory_ / (name_ + ".last")));
  start();
  (void)serve(first);
  await_ready();
  EXPECT_THAT(task_->errors(), HasSubstr(kRefused));
  connection_ = {};
  EXPECT_EQ(task_->terminate(), 0);
}

/// A supervisor that has no room for what is to be stored.
TEST_F(PredecessorOffer, ASegmentThatIsNotStoredIsReported) {
  const std::string path = (directory_ / "notify").string();
  const std::vector<std::string> environment{"NOTIFY_SOCKET=" + path};  // nobody listens
  start(environment);
  await_ready();
  EXPECT_THAT(task_->errors(), HasSubstr("the next task begins with an unverified position"));
  EXPECT_EQ(task_->terminate(), 0);
}

}  // namespace
}  // namespace corbot::test
