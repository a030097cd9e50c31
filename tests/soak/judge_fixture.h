// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "config/load_profile.h"
#include "soak/signature.h"
#include "soak/stall_watch.h"
#include "soak/verdict.h"
#include "support/paths.h"

namespace corbot::soak {

/// Plants the faults that the soak must find: made-up recordings and made-up reports of clients.
class Judge : public ::testing::Test {
 protected:
  static constexpr std::int64_t kCycle_ns = 1'000'000;
  using Meanwhile = std::function<void(int cycle)>;

  Judge() : profile_(load_profile(CORBOT_SHIPPED_PROFILE)), recording_(profile_) {
    recording_.read(
        "cycle,time_ns,wall_ns,state,command,rate,theta0_deg,theta1_deg,theta2_deg,theta3_deg,x_m,y_m,z_m,"
        "gripper,device,flags");
    rest(3);
  }

  void row(std::uint64_t command, const char* state) {
    ++cycle_;
    recording_.read(fmt::format("{},{},0,{},{},{},{:.9f},{:.9f},0,0,{:.12f},{:.12f},{:.12f},0,{},{}", cycle_,
                                now_ns(), state, command, rate_, base_deg_, shoulder_deg_, x_m_, y_m_, z_m_,
                                device_, flags_));
  }
  void rest(int cycles) {
    for (int i = 0; i < cycles; ++i) row(0, "standby");
  }
  /// No cycle runs, and none is counted.
  void silence(double seconds) { time_ns_ += static_cast<std::int64_t>(seconds * 1e9); }

  /// From 0 to 1 in so many cycles, from rest to rest, smoothly.
  void run(std::uint64_t id, int cycles, const std::function<void(double)>& go,
           const Meanwhile& meanwhile = {}) {
    for (int i = 1; i <= cycles; ++i) {
      const double s = static_cast<double>(i) / (cycles + 1);
      go(s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
      row(id, "moving");
      if (meanwhile) meanwhile(i);
    }
    go(1.0);
    rest(4);
  }
  /// Command `id` turns the base by `degrees`, or a part of it, in 0.4 s within its limits.
  void move(std::uint64_t id, double degrees, const Meanwhile& meanwhile = {}) {
    const double from_deg = base_deg_;
    run(
        id, 400, [&](double s) { base_deg_ = s == 1.0 ? from_deg + degrees : from_deg + s * degrees; },
        meanwhile);
  }
  /// To where `begin("StartMoveS", mark)` asks it to go.
  void line(std::uint64_t id, std::int64_t mark, int cycles = 700, double off_m = 0.0) {
    const double from_m = y_m_;
    run(id, cycles, [&](double s) {
      y_m_ = s == 1.0 ? sign_metres(305, mark) : from_m + s * (sign_metres(305, mark) - from_m);
      z_m_ = 0.1 + 4.0 * off_m * s * (1.0 - s);
    });
  }
  /// Half a circle of 25 mm about (0.3, 0.0, 0.1), from y = -25 mm over x = 325 mm to y = 25 mm and what the
  /// mark adds.
  void arc(std::uint64_t id, std::int64_t mark, int cycles, double off_m = 0.0) {
    run(id, cycles, [&](double s) {
      const double angle = M_PI * (s - 0.5);
      x_m_ = 0.3 + (0.025 + 4.0 * off_m * s * (1.0 - s)) * std::cos(angle);
      y_m_ = sign_metres(0, mark) + 0.025 * std::sin(angle);
    });
  }
  void go_to_arc(std::int64_t mark) {
    x_m_ = 0.3;
    y_m_ = sign_metres(0, mark) - 0.025;
    cycle_ += 5;
    rest(5);
  }
  [[nodiscard]] std::int64_t now_ns() const {
    return static_cast<std::int64_t>(cycle_) * kCycle_ns + time_ns_;
  }

  /// A call of client 1 that begins now and is answered at once.
  void call(const std::string& operation, std::int64_t mark, const std::string& outcome = "ok",
            std::uint64_t ticket = 0, double took_s = 0.0, const std::string& where = "") {
    begin(operation, mark, where);
    end(calls_, outcome, ticket, took_s);
  }
  void end(int number, const std::string& outcome, std::uint64_t ticket = 0, double took_s = 0.0) {
    ledger_.read(client_,
                 fmt::format("end {} {} {} {}", number, now_ns() + nanoseconds(took_s), outcome, ticket));
  }
  /// A drive of the base by sign_degrees(10, mark), a line to y = sign_metres(305, mark), an arc as above.
  int begin(const std::string& operation, std::int64_t mark, std::string where = "") {
    if (where.empty() && operation.ends_with("MoveS"))
      where = fmt::format("0.3 {:.15f} 0.1", sign_metres(305, mark));
    if (where.empty() && operation.ends_with("MoveC"))
      where = fmt::format("0.3 {0:.15f} 0.1 0.325 {1:.15f} 0.1 0.3 {2:.15f} 0.1", sign_metres(-250, mark),
                          sign_metres(0, mark), sign_metres(250, mark));
    if (where.empty()) where = fmt::format("0 {:.12f}", sign_degrees(10, mark));
    ledger_.read(client_,
                 fmt::format("begin {} {} {} {} {} {}", ++calls_, now_ns(), operation, mark, key_, where));
    return calls_;
  }
  int begin_drive(const std::string& operation, std::int64_t mark, double by_deg) {
    return begin(operation, mark, fmt::format("0 {:.12f}", by_deg));
  }

  [[nodiscard]] Verdict verdict() const {
    return judge({profile_, ledger_, recording_, breaks_, stalls_, clears_, restarts_});
  }
  [[nodiscard]] std::vector<std::string> faults() const { return verdict().faults; }

  Profile profile_;
  Recording recording_;
  Ledger ledger_;
  std::uint64_t cycle_{100};
  std::int64_t time_ns_{0};  // in which no cycle ran
  int client_{1};
  int calls_{0};
  int key_{0};
  double rate_{1.0};
  const char* flags_{"-"};
  std::string device_{"open"};  ///< its health
  double base_deg_{0.0};
  double shoulder_deg_{0.0};
  double x_m_{0.3};
  double y_m_{0.0};
  double z_m_{0.1};
  std::vector<Break> breaks_;
  std::vector<Interval> stalls_;
  std::vector<Clear> clears_;
  std::vector<Restart> restarts_;
};

}  // namespace corbot::soak
