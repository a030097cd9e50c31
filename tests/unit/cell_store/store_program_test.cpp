// SPDX-License-Identifier: Apache-2.0
// corbot-store as its clients see it: the fields of its exceptions, a failed database, SIGKILL, its end
// while a call waits, and a flood of connections.
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <future>
#include <string>
#include <vector>

#include "cell.hh"
#include "cell/store/database.h"
#include "support/giop.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/process.h"

namespace corbot::cell {
namespace {

using namespace Corbot;
using test::within;

class StoreProgram : public ::testing::Test {
 protected:
  StoreProgram() {
    std::string path = CORBOT_SCRATCH_DIR "/store-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    program_.emplace(start());
    int argc = 0;
    orb_ = CORBA::ORB_init(argc, nullptr);
  }
  ~StoreProgram() override {
    store_ = Store::_nil();
    orb_->destroy();
    program_.reset();
    std::filesystem::remove_all(directory_);
  }

  [[nodiscard]] std::vector<std::string> command() const {
    return {CORBOT_BIN_DIR "/corbot-store",
            CORBOT_CELL "/cell.toml",
            "--ports",
            std::to_string(port_),
            "--state-dir",
            (directory_ / "state").string()};
  }
  [[nodiscard]] test::Process start() const { return test::Process(command()); }
  void connect() {
    const auto ready = program_->wait_line("ready ", within(30));
    ASSERT_TRUE(ready) << program_->errors();
    const CORBA::Object_var object = orb_->string_to_object(ready->substr(6).c_str());
    store_ = Store::_unchecked_narrow(object);
    const auto is_there = [&] {
      try {
        return !store_->_non_existent();
      } catch (const CORBA::SystemException&) {
        return false;  // the connection to the process before
      }
    };
    ASSERT_TRUE(test::wait_until(within(30), is_there));
  }

  const int port_{test::free_port()};
  std::filesystem::path directory_;
  std::optional<test::Process> program_;
  CORBA::ORB_var orb_;
  Store_var store_;
};

TEST_F(StoreProgram, RaisesWhatHappened) {
  connect();
  const ClaimToken token = store_->Claim("robot1", "test@here", 0);
  try {
    store_->Claim("robot1", "other", 0);
    ADD_FAILURE();
  } catch (const Claimed& claimed) {
    EXPECT_STREQ(claimed.robot, "robot1");
    EXPECT_STREQ(claimed.who, "test@here");
    EXPECT_EQ(claimed.token, token);
  }
  try {
    store_->Enter(token, "store1", 31);
    ADD_FAILURE();
  } catch (const BadParameter& bad) {
    EXPECT_STREQ(bad.parameter, "timeout");
    EXPECT_EQ(bad.value, 31);
    EXPECT_STREQ(bad.reason, "must be from 0 to 30 s");
  }
  try {
    store_->Leave(token, "pallet9");
    ADD_FAILURE();
  } catch (const BadParameter& bad) {
    EXPECT_STREQ(bad.parameter, "place");
    EXPECT_STREQ(bad.reason, "'pallet9' is no place of cell 'demo'");
  }
  try {
    store_->Leave(token + 7, "store1");
    ADD_FAILURE();
  } catch (const Superseded& superseded) {
    EXPECT_EQ(superseded.token, token + 7);
    EXPECT_EQ(superseded.present, 0U);
  }
  try {
    store_->Advance(token, 1, StepHeld, "");
    ADD_FAILURE();
  } catch (const WrongStep& wrong) {
    EXPECT_EQ(wrong.present, StepPlaced);
    EXPECT_EQ(wrong.wanted, StepHeld);
  }
  try {
    const TransferInfo_var none = store_->Reserve(token, "store1", "pallet2", Sightings(), 0);
    ADD_FAILURE();
  } catch (const Empty& empty) {
    EXPECT_STREQ(empty.place, "store1");
  }
  store_->Enter(token, "store1", 0);
  try {
    store_->Enter(store_->Claim("robot2", "test", 0), "store1", 0.01);
    ADD_FAILURE();
  } catch (const Occupied& occupied) {
    EXPECT_STREQ(occupied.place, "store1");
    EXPECT_STREQ(occupied.robot, "robot1");
    EXPECT_GT(occupied.since, 1e9);
  }
}

TEST_F(StoreProgram, ADatabaseThatFailsIsNotReadyAndThenGoesOn) {
  connect();
  const ClaimToken token = store_->Claim("robot1", "test", 0);
  Database database(directory_ / "state" / "ledger.db");
  database.run("ALTER TABLE zone RENAME TO lost");
  EXPECT_THROW(store_->Enter(token, "store1", 30), NotReady);
  EXPECT_THROW(PlaceInfos_var(store_->Places()), CORBA::TRANSIENT);
  database.run("ALTER TABLE lost RENAME TO zone");
  store_->Enter(token, "store1", 0);
  PlaceInfos_var places = store_->Places();
  EXPECT_STREQ(places[1].robot, "robot1");
}

TEST_F(StoreProgram, OutlivesItsKillAndEndsWhileACallWaits) {
  connect();
  const ClaimToken token = store_->Claim("robot1", "test", 0);
  store_->Enter(token, "store1", 0);
  program_->signal(SIGKILL);
  ASSERT_TRUE(program_->wait(within(10)));
  program_.emplace(start());
  connect();
  store_->Enter(token, "store1", 0);  // repeated
  const ClaimToken second = store_->Claim("robot2", "test", 0);
  EXPECT_GT(second, token);

  auto waiting = std::async(std::launch::async, [&] { store_->Enter(second, "store1", 30); });
  EXPECT_EQ(waiting.wait_for(std::chrono::milliseconds(300)), std::future_status::timeout) << "it waits";
  const auto deadline = within(15);
  EXPECT_EQ(program_->terminate(), 0);
  EXPECT_LT(std::chrono::steady_clock::now(), deadline) << "it waited 30 s for the call";
  EXPECT_ANY_THROW(waiting.get());
}

TEST_F(StoreProgram, NamesALedgerThatBeginsAnew) {
  connect();
  ASSERT_EQ(program_->terminate(), 0);
  std::filesystem::resize_file(directory_ / "state" / "ledger.db", 0);
  program_.emplace(start());
  connect();
  EXPECT_NE(program_->errors().find("ledger.db: a ledger without pieces begins"), std::string::npos)
      << program_->errors();
  ASSERT_EQ(program_->terminate(), 0);
  program_.emplace(start());
  connect();
  EXPECT_EQ(program_->errors().find("begins"), std::string::npos) << program_->errors();
}

/// The arguments of Enter in eights of bytes.
std::vector<double> enter_store1(ClaimToken token, double timeout_s) {
  static constexpr char kPlace[17] = "\7\0\0\0store1\0\0\0\0\0";
  std::vector<double> arguments(4, timeout_s);
  std::memcpy(&arguments[0], &token, sizeof(token));
  std::memcpy(&arguments[1], kPlace, 2 * sizeof(double));
  return arguments;
}

TEST_F(StoreProgram, AFloodOfIdleConnectionsShutsOutNoCallAndEndsNoneThatWaits) {
  program_->terminate();
  std::vector<std::string> words{"/bin/sh", "-c", "ulimit -n 200; exec \"$0\" \"$@\""};
  for (const std::string& word : command()) words.push_back(word);
  program_.emplace(words);
  connect();
  const ClaimToken first = store_->Claim("robot1", "test", 0);
  const ClaimToken second = store_->Claim("robot2", "test", 0);
  store_->Enter(first, "store1", 0);
  // A client's ORB would send the call again, unseen.
  test::RawConnection waiting(port_);
  ASSERT_TRUE(waiting.send(test::giop_request(2, "Store", "Enter", enter_store1(second, 30))));
  ASSERT_FALSE(waiting.reply(within(0.3))) << "it waits";
  std::vector<test::RawConnection> idle;
  for (int i = 0; i < 400; ++i) {
    idle.emplace_back(port_);
    idle.back().send("GIOP");
  }
  test::RawConnection client(port_);
  EXPECT_TRUE(client.send(test::giop_request(1, "Store", "_get_Places")));
  const auto reply = client.reply(within(10));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->status, 0U);
  store_->Leave(first, "store1");
  const auto entered = waiting.reply(within(10));
  ASSERT_TRUE(entered);
  EXPECT_EQ(entered->status, 0U);
}

TEST_F(StoreProgram, AFloodOfGarbageDoesNotFillTheLog) {
  connect();
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 300; ++i) {
    test::RawConnection rude(port_);
    ASSERT_TRUE(rude.send(test::giop_header(77, 4, false, 2) + "none"));  // no type of message
    ASSERT_TRUE(rude.closed(within(30)));
  }
  EXPECT_FALSE(store_->_non_existent());
  const std::string log = program_->errors();
  const auto lines = std::count(log.begin(), log.end(), '\n');
  const auto minutes = (std::chrono::steady_clock::now() - begin) / std::chrono::minutes(1);
  EXPECT_LE(lines, 150 + 101 * minutes) << log;
  EXPECT_GE(lines, 100) << log;
}

}  // namespace
}  // namespace corbot::cell
