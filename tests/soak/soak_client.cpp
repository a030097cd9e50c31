// SPDX-License-Identifier: Apache-2.0
// soak_client REFERENCE NUMBER SEED: calls the robot at random for ever and prints two lines a call, so that a client
// that is killed leaves what it had begun:
//   begin CALL TIME_NS OPERATION SIGNATURE [WHERE...]
//   end CALL TIME_NS OUTCOME TICKET
// TIME_NS is CLOCK_MONOTONIC. SIGNATURE is unique to the call and is part of where the motion goes (see signature.h); 0
// where nothing moves. WHERE is the motion's end: joint and degrees of a Drive, all angles, or x, y and z. OUTCOME is 'ok', the state that Status returned, or the name of an exception; TICKET 0 where
// there is none.
// soak_client REFERENCE NUMBER watch: reads Status only.
// soak_client REFERENCE tickets N...: prints 'ticket N STATE' for each, and ends.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <random>
#include <string>

#include <fmt/core.h>
#include <arm.hh>

#include "soak/signature.h"

namespace corbot::soak {
namespace {

constexpr int kJoints = 4;
constexpr double kLower_deg[kJoints] = {-60.0, -10.0, 0.0, -30.0};  // well inside the Lynx 5's ranges
constexpr double kUpper_deg[kJoints] = {60.0, 90.0, 110.0, 100.0};

std::int64_t now_ns() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

void say(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

/// The calls of one client, one after another.
class Caller {
 public:
  Caller(Corbot::Arm_ptr arm, int client, std::uint64_t seed)
      : arm_(Corbot::Arm::_duplicate(arm)), client_(client), random_(seed) {}

  /// Reads the state ten times a second.
  [[noreturn]] void watch() {
    for (;;) {
      status();
      const timespec time{0, 100'000'000};
      ::nanosleep(&time, nullptr);
    }
  }

  [[noreturn]] void run() {
    for (;;) {
      const int choice = between(0, 99);
      if (choice < 30) {
        start_drive();
      } else if (choice < 45) {
        drive();
      } else if (choice < 60) {
        move_joints();
      } else if (choice < 75) {
        move_straight();
      } else if (choice < 88) {
        wait();
      } else if (choice < 93) {
        call("Stop", 0, [&](std::uint64_t&) { arm_->Stop(); });
      } else {
        status();
      }
      pause();
    }
  }

 private:
  int between(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

  void pause() {
    const timespec time{0, std::int64_t{between(0, 120)} * 1'000'000};
    ::nanosleep(&time, nullptr);
  }

  template <class Call>
  void call(const char* operation, std::int64_t signature, Call&& body, const std::string* answer = nullptr,
            const std::string& where = "") {
    const int number = ++calls_;
    say(fmt::format("begin {} {} {} {}{}", number, now_ns(), operation, signature, where));
    std::uint64_t ticket = 0;
    std::string outcome = "ok";
    try {
      body(ticket);
      if (answer != nullptr) outcome = *answer;
    } catch (const CORBA::SystemException& error) {
      outcome = fmt::format("{}/{}", error._name(), static_cast<int>(error.completed()));
    } catch (const CORBA::Exception& error) {
      outcome = error._name();
    }
    say(fmt::format("end {} {} {} {}", number, now_ns(), outcome, ticket));
    if (ticket != 0) tickets_.push_back(ticket);
    if (tickets_.size() > 8) tickets_.pop_front();
  }

  std::int64_t next_signature() { return signature(client_, ++moves_); }

  /// A joint and an increment that leads back into the middle of its range.
  std::pair<int, double> increment(std::int64_t of) {
    const int joint = between(0, kJoints - 1);
    double at = 0.0;
    try {
      Corbot::JointCoord_var joints = arm_->ArtiCoord();
      at = joints[static_cast<CORBA::ULong>(joint)];
    } catch (const CORBA::Exception&) {  // then from the middle: refused at worst
      at = 0.5 * (kLower_deg[joint] + kUpper_deg[joint]);
    }
    const double size = sign_degrees(between(10, 60), of);
    const bool down = at + size > kUpper_deg[joint] || (at - size > kLower_deg[joint] && between(0, 1) == 0);
    return {joint, down ? -size : size};
  }

  void start_drive() {
    const std::int64_t mark = next_signature();
    const auto [joint, by] = increment(mark);
    call(
        "StartDrive", mark,
        [&, joint = joint, by = by](std::uint64_t& ticket) { ticket = arm_->StartDrive(joint, by, 90.0); },
        nullptr, fmt::format(" {} {:.12f}", joint, by));
  }

  void drive() {
    const std::int64_t mark = next_signature();
    const auto [joint, by] = increment(mark);
    call(
        "Drive", mark, [&, joint = joint, by = by](std::uint64_t&) { arm_->Drive(joint, by, 120.0); },
        nullptr, fmt::format(" {} {:.12f}", joint, by));
  }

  void move_joints() {
    const std::int64_t mark = next_signature();
    Corbot::JointCoord target;
    target.length(kJoints);
    std::string where;
    for (int i = 0; i < kJoints; ++i) {
      const int low = static_cast<int>(kLower_deg[i] / kGrid_deg);
      const int high = static_cast<int>(kUpper_deg[i] / kGrid_deg);
      target[static_cast<CORBA::ULong>(i)] = sign_degrees(between(low + 1, high - 1), i == 0 ? mark : 0);
      where += fmt::format(" {:.12f}", target[static_cast<CORBA::ULong>(i)]);
    }
    call(
        "StartMoveJoints", mark, [&](std::uint64_t& ticket) { ticket = arm_->StartMoveJoints(target, 0.0); },
        nullptr, where);
  }

  void move_straight() {
    const std::int64_t mark = next_signature();
    const double x = 0.001 * between(190, 220);
    const double y = sign_metres(between(-300, 300), mark);
    const double z = 0.001 * between(80, 110);
    call(
        "StartMoveS", mark, [&](std::uint64_t& ticket) { ticket = arm_->StartMoveS(x, y, z, 0.0, 0.0); },
        nullptr, fmt::format(" {:.15f} {:.15f} {:.15f}", x, y, z));
  }

  void status() {
    std::string state;
    call(
        "Status", 0,
        [&](std::uint64_t&) {
          static constexpr const char* kNames[] = {"Error", "Waiting", "Standby"};
          state = kNames[arm_->Status()];
        },
        &state);
  }

  void wait() {
    if (tickets_.empty()) return;
    const std::uint64_t ticket =
        tickets_[static_cast<std::size_t>(between(0, static_cast<int>(tickets_.size()) - 1))];
    call("Wait", static_cast<std::int64_t>(ticket),
         [&](std::uint64_t&) { Corbot::MotionInfo_var info = arm_->Wait(ticket, 0.001 * between(0, 3000)); });
  }

  Corbot::Arm_var arm_;
  int client_;
  std::mt19937_64 random_;
  int calls_{0};
  int moves_{0};
  std::deque<std::uint64_t> tickets_;
};

void print_ticket(Corbot::Arm_ptr arm, std::uint64_t ticket) {
  static constexpr const char* kNames[] = {"queued", "running", "done", "stopped", "failed"};
  std::string state;
  try {
    Corbot::MotionInfo_var info = arm->Progress(ticket);
    state = kNames[info->state];
  } catch (const CORBA::Exception& error) {
    state = error._name();
  }
  say(fmt::format("ticket {} {}", ticket, state));
}

}  // namespace
}  // namespace corbot::soak

int main(int argc, char** argv) try {
  if (argc < 3) return 2;
  int orb_argc = 1;
  CORBA::ORB_var orb = CORBA::ORB_init(orb_argc, argv);
  CORBA::Object_var object = orb->string_to_object(argv[1]);
  Corbot::Arm_var arm = Corbot::Arm::_unchecked_narrow(object);
  if (std::string(argv[2]) == "tickets") {
    for (int i = 3; i < argc; ++i) corbot::soak::print_ticket(arm, std::strtoull(argv[i], nullptr, 10));
    return 0;
  }
  if (argc < 4) return 2;
  corbot::soak::Caller caller(arm, std::atoi(argv[2]), std::strtoull(argv[3], nullptr, 10));
  if (std::string(argv[3]) == "watch") caller.watch();
  caller.run();
} catch (const CORBA::Exception& error) {
  corbot::soak::say(fmt::format("failed {}", error._name()));
  return 1;
}
