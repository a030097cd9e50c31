// SPDX-License-Identifier: Apache-2.0
// Calls the robot at random for ever, or reads from it:
// `soak_client REFERENCE NUMBER SEED` calls at random and prints two lines a call, so that a killed client
// leaves the call that it had begun.
// `soak_client REFERENCE NUMBER watch` reads Status only.
// `soak_client REFERENCE tickets N...` prints 'ticket N STATE' for each, and ends.
// `soak_client REFERENCE motions` prints 'motion BEGIN_S DURATION_S' for each motion once it has begun.
// BEGIN_S is of the Unix epoch and late by one look at most, DURATION_S is planned. The two lines of a call:
// `begin CALL TIME_NS OPERATION SIGNATURE KEY [WHERE...]`
// `end CALL TIME_NS OUTCOME TICKET [REASON]`
// TIME_NS is CLOCK_MONOTONIC. SIGNATURE is unique to the call and is part of the motion's goal (see
// signature.h). For a Wait or Cancel it is the ticket, for a call without a motion 0. KEY is the CALL of the
// Acquire whose reference was used, 0: the public one. WHERE is joint and degrees of a Drive, all angles, the
// points of a line or an arc, the lease, or the time to wait. OUTCOME is 'ok', the state that Status
// returned, or the name of an exception. TICKET is 0 if there is none.
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
      const int choice = between(0, 999);
      if (choice < 800) {
        move();
      } else if (choice < 880) {
        wait();
      } else if (choice < 895) {
        call("Stop", 0, [&](std::uint64_t&) { arm_->Stop(); });
      } else if (choice < 920) {
        cancel();
      } else if (choice < 935) {
        hold_still();
      } else if (choice < 945) {
        call("Resume", 0, [&](std::uint64_t&) { arm_->Resume(); });
      } else if (choice < 960) {
        take_control();
      } else if (choice < 962) {
        call("StopAndHold", 0, [&](std::uint64_t&) { arm_->StopAndHold(); });
      } else {
        status();
      }
      pause();
    }
  }

 private:
  int between(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

  static void sleep(double seconds) {
    const auto whole = static_cast<time_t>(seconds);
    const timespec time{whole, static_cast<long>((seconds - static_cast<double>(whole)) * 1e9)};
    ::nanosleep(&time, nullptr);
  }
  void pause() { sleep(0.001 * between(0, 120)); }

  void move() {
    if (between(0, 29) == 0) return grip();
    switch (between(0, 9)) {
      case 0:
      case 1:
        return start_drive();
      case 2:
        return drive();
      case 3:
        return move_joints();
      case 4:
      case 5:
      case 6:
        return move_straight();
      default:
        return move_round();
    }
  }

  template <class Call>
  void call(const char* operation, std::int64_t signature, Call&& body, const std::string* answer = nullptr,
            const std::string& where = "") {
    const int number = ++calls_;
    say(fmt::format("begin {} {} {} {} {}{}", number, now_ns(), operation, signature, key_, where));
    std::uint64_t ticket = 0;
    std::string outcome = "ok";
    std::string reason;
    try {
      body(ticket);
      if (answer != nullptr) outcome = *answer;
    } catch (const Corbot::NotReady& error) {
      outcome = "NotReady";
      reason = fmt::format(" {}", error.reason.in());
    } catch (const CORBA::SystemException& error) {
      outcome = fmt::format("{}/{}", error._name(), static_cast<int>(error.completed()));
    } catch (const CORBA::Exception& error) {
      outcome = error._name();
    }
    say(fmt::format("end {} {} {} {}{}", number, now_ns(), outcome, ticket, reason));
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

  void grip() {
    between(0, 1) == 0 ? call("StartOpen", 0, [&](std::uint64_t& ticket) { ticket = arm_->StartOpen(); })
                       : call("StartClose", 0, [&](std::uint64_t& ticket) { ticket = arm_->StartClose(); });
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

  /// A point in a box that the arm reaches from everywhere around it.
  Corbot::Point some_point(double y) { return {0.001 * between(185, 215), y, 0.001 * between(75, 115)}; }
  static std::string words(const Corbot::Point& p) {
    return fmt::format(" {:.15f} {:.15f} {:.15f}", p.x, p.y, p.z);
  }

  void move_straight() {
    const std::int64_t mark = next_signature();
    const Corbot::Point to = some_point(sign_metres(between(-500, 500), mark));
    if (between(0, 1) == 0) {
      call(
          "MoveS", mark, [&](std::uint64_t&) { arm_->MoveS(to.x, to.y, to.z, 0.0, 0.0); }, nullptr,
          words(to));
    } else {
      call(
          "StartMoveS", mark,
          [&](std::uint64_t& ticket) { ticket = arm_->StartMoveS(to.x, to.y, to.z, 0.0, 0.0); }, nullptr,
          words(to));
    }
  }

  /// From one side to the other over a point in between: radii from 15 mm on.
  void move_round() {
    const std::int64_t mark = next_signature();
    const Corbot::Point from = some_point(sign_metres(between(-500, -200), mark));
    const Corbot::Point to = some_point(sign_metres(between(200, 500), mark));
    const Corbot::Point over{0.5 * (from.x + to.x) + 0.001 * between(3, 20), 0.0,
                             0.5 * (from.z + to.z) + 0.001 * between(-15, 15)};
    const std::string where = words(from) + words(over) + words(to);
    if (between(0, 1) == 0) {
      call(
          "MoveC", mark, [&](std::uint64_t&) { arm_->MoveC(from, over, to); }, nullptr, where);
    } else {
      call(
          "StartMoveC", mark, [&](std::uint64_t& ticket) { ticket = arm_->StartMoveC(from, over, to); },
          nullptr, where);
    }
  }

  /// Pauses the arm for a while. The client resumes it, unless it is killed meanwhile.
  void hold_still() {
    call("Pause", 0, [&](std::uint64_t&) { arm_->Pause(); });
    sleep(between(0, 4) < 2 ? 0.001 * between(2200, 3000) : 0.001 * between(50, 500));
    call("Resume", 0, [&](std::uint64_t&) { arm_->Resume(); });
  }

  void cancel() {
    if (tickets_.empty()) return;
    const std::uint64_t ticket = between(0, 1) == 0 ? tickets_.back() : some_ticket();
    call("Cancel", static_cast<std::int64_t>(ticket), [&](std::uint64_t&) { arm_->Cancel(ticket); });
  }

  /// Exclusive control: some motions, then given back, or kept until the lease has run out.
  void take_control() {
    const double lease_s = 0.001 * between(500, 1500);
    call("Stop", 0, [&](std::uint64_t&) { arm_->Stop(); });  // nothing may be under way
    Corbot::Arm_var held;
    for (int attempt = 0; attempt < 3 && CORBA::is_nil(held); ++attempt) {
      call(
          "Acquire", 0, [&](std::uint64_t&) { held = arm_->Acquire("soak", lease_s); }, nullptr,
          fmt::format(" {}", lease_s));
    }
    if (CORBA::is_nil(held)) return;
    const Corbot::Arm_var everyones = arm_;
    arm_ = held;
    key_ = calls_;
    for (int n = between(1, 5); n > 0; --n) {
      between(0, 4) == 0 ? call("Renew", 0, [&](std::uint64_t&) { arm_->Renew(); }) : move();
      pause();
    }
    if (between(0, 1) == 0) {
      call("Release", 0, [&](std::uint64_t&) { arm_->Release(); });
    } else {
      start_slow_drive();
      sleep(lease_s + 0.7);
      between(0, 1) == 0 ? start_drive() : call("Renew", 0, [&](std::uint64_t&) { arm_->Renew(); });
    }
    arm_ = everyones;
    key_ = 0;
  }

  /// Several seconds, so that the lease runs out on the way.
  void start_slow_drive() {
    const std::int64_t mark = next_signature();
    const auto [joint, by] = increment(mark);
    call(
        "StartDrive", mark,
        [&, joint = joint, by = by](std::uint64_t& ticket) { ticket = arm_->StartDrive(joint, by, 5.0); },
        nullptr, fmt::format(" {} {:.12f}", joint, by));
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
    const std::uint64_t ticket = some_ticket();
    const double timeout_s = 0.001 * between(0, 3000);
    call(
        "Wait", static_cast<std::int64_t>(ticket),
        [&](std::uint64_t&) { Corbot::MotionInfo_var info = arm_->Wait(ticket, timeout_s); }, nullptr,
        fmt::format(" {}", timeout_s));
  }

  std::uint64_t some_ticket() {
    return tickets_[static_cast<std::size_t>(between(0, static_cast<int>(tickets_.size()) - 1))];
  }

  Corbot::Arm_var arm_;  ///< the public reference, or the holder's
  int key_{0};           ///< of the holder's the call that returned it
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

/// Tickets are given in a row, so a motion that is over between two looks is not left out.
[[noreturn]] void print_motions(Corbot::Arm_ptr arm) {
  for (std::uint64_t last = 0;;) {
    const Corbot::ArmState_var state = arm->State();
    for (const std::uint64_t newest = state->motion.id; last < newest;) {
      const Corbot::MotionInfo_var motion = arm->Progress(++last);
      say(fmt::format("motion {:.3f} {:.6f}", state->time, motion->duration));
    }
    const timespec time{0, 20'000'000};
    ::nanosleep(&time, nullptr);
  }
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
  if (std::string(argv[2]) == "motions") corbot::soak::print_motions(arm);
  if (argc < 4) return 2;
  corbot::soak::Caller caller(arm, static_cast<int>(std::strtol(argv[2], nullptr, 10)),
                              std::strtoull(argv[3], nullptr, 10));
  if (std::string(argv[3]) == "watch") caller.watch();
  caller.run();
} catch (const CORBA::Exception& error) {
  corbot::soak::say(fmt::format("failed {}", error._name()));
  return 1;
}
