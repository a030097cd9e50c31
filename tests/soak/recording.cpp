// SPDX-License-Identifier: Apache-2.0
#include "soak/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <utility>

#include "corbot/units.h"

namespace corbot::soak {
namespace {

constexpr double kRounding_deg = 3.0 * kAngleDigit_deg;  // of two recorded angles
/// After a longer gap the servos have come to rest, see rt/cycle/liveness.h.
constexpr std::int64_t kRestartPeriods = 5;

}  // namespace

void Recording::read_header(const std::string& line) {
  std::istringstream stream(line);
  std::string word;
  device_column_ = flags_column_ = 0;
  for (std::size_t i = 0; std::getline(stream, word, ','); ++i) {
    if (word == "device") device_column_ = i;
    if (word == "flags") flags_column_ = i;
  }
}

bool Recording::parse(const std::string& line, Cycle& row) const {
  std::istringstream stream(line);
  std::string word;
  std::vector<std::string> words;
  while (std::getline(stream, word, ',')) words.push_back(word);
  if (words.size() < 13 || words[0].empty() || words[0].find_first_not_of("0123456789") != std::string::npos)
    return false;
  row.cycle = std::strtoull(words[0].c_str(), nullptr, 10);
  row.time_ns = std::strtoll(words[1].c_str(), nullptr, 10);
  row.state = words[3];
  row.command = std::strtoull(words[4].c_str(), nullptr, 10);
  row.rate = std::strtod(words[5].c_str(), nullptr);
  for (std::size_t i = 0; i < 4; ++i) row.theta_deg[i] = std::strtod(words[6 + i].c_str(), nullptr);
  for (std::size_t i = 0; i < 3; ++i) row.tcp_m[i] = std::strtod(words[10 + i].c_str(), nullptr);
  const auto column = [&](std::size_t i) { return i > 0 && i < words.size() ? words[i] : std::string(); };
  row.device = column(device_column_);
  row.is_unverified = column(flags_column_).find("unverified") != std::string::npos;
  row.is_fault_stop = column(flags_column_).find("fault_stop") != std::string::npos;
  row.is_power_off = column(flags_column_).find("power_off") != std::string::npos;
  return true;
}

void Recording::read(const std::string& line) {
  if (line.starts_with("cycle,")) {
    have_last_ = false;
    is_new_life_ = true;
    read_header(line);
    return;
  }
  Cycle row;
  if (!parse(line, row)) return;
  const bool is_new_life = std::exchange(is_new_life_, false);
  if (is_new_life) lives_.push_back(row.time_ns);
  ++cycles_;
  if (observer_) observer_(row);
  // A task that is killed while it writes leaves one slot of the flight recorder unreadable.
  const bool continuous = have_last_ && row.cycle > last_.cycle && row.cycle - last_.cycle <= 2;
  if (have_last_ && !continuous) ++gaps_;
  if (last_ns_ != 0 && row.time_ns - last_ns_ > arm_.period_ns)
    silences_.push_back({{last_ns_, row.time_ns}, is_new_life});
  last_ns_ = row.time_ns;
  check(row);
  note_movement(row);
  note_pause(row);
  follow(row, continuous);
  last_ = row;
  have_last_ = true;
}

void Recording::fault(const Cycle& row, const std::string& text) {
  if (faults_.size() < 100)
    faults_.push_back(fmt::format("cycle {} ({}, command {}): {}", row.cycle, row.state, row.command, text));
}

void Recording::check(const Cycle& row) {
  const double period_s = static_cast<double>(arm_.period_ns) * 1e-9;
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    const JointLimits& limits = arm_.joints[i];
    const double lower_deg = to_degrees(limits.lower_q) - kRounding_deg;
    const double upper_deg = to_degrees(limits.upper_q) + kRounding_deg;
    if (!(row.theta_deg[i] >= lower_deg && row.theta_deg[i] <= upper_deg))
      fault(row, fmt::format("joint {} at {} degrees, allowed {} to {}", i, row.theta_deg[i], lower_deg,
                             upper_deg));
    // Also across cycles that were not recorded: a cycle is counted, or the arm stood still.
    if (!have_last_ || row.cycle <= last_.cycle || row.follows_device() || last_.follows_device()) continue;
    const double cycles = static_cast<double>(row.cycle - last_.cycle);
    const double step_deg = std::abs(row.theta_deg[i] - last_.theta_deg[i]);
    const double allowed_deg =
        to_degrees(limits.speed_q_s) * period_s * cycles * (1.0 + 1e-6) + kRounding_deg;
    if (step_deg > allowed_deg)
      fault(row,
            fmt::format("joint {} by {} degrees in {} cycles, allowed {}", i, step_deg, cycles, allowed_deg));
  }
}

void Recording::note_movement(const Cycle& row) {
  if (!have_last_ || row.follows_device() || last_.follows_device()) return;
  bool moved = false;
  for (std::size_t i = 0; i < arm_.dof; ++i)
    moved = moved || std::abs(row.theta_deg[i] - last_.theta_deg[i]) > kRounding_deg;
  if (!moved) return;
  if (moving_.empty() || last_.time_ns > moving_.back().end_ns) moving_.push_back({row.time_ns, row.time_ns});
  moving_.back().end_ns = row.time_ns;
}

void Recording::note_pause(const Cycle& row) {
  if (row.state != "paused") return;
  if (!have_last_ || last_.state != "paused") paused_.push_back({row.time_ns, row.time_ns});
  paused_.back().end_ns = row.time_ns;
}

/// Measures the new set-point against those before it, for its motion. The first cycles after a motion's end
/// belong to it: the arm must have come to rest in them.
void Recording::measure(const Cycle& row) {
  constexpr int kTicksOfRest = 3;
  const bool is_adjacent = have_last_ && row.cycle == last_.cycle + 1;
  const bool begins = row.command != 0 && (!have_last_ || row.command != last_.command);
  const bool has_rested = have_last_ && row.time_ns - last_.time_ns > kRestartPeriods * arm_.period_ns;
  if (!is_adjacent) {
    ticks_.forget();
    ticks_of_rest_ = 0;
  } else if (begins || has_rested) {
    for (; begins && ticks_of_rest_ > 0; --ticks_of_rest_) {
      ticks_.add(last_.theta_deg, last_.tcp_m);
      ticks_.measure(last_.cycle, motions_[motions_.size() - 2].peaks);
    }
    ticks_.rest(last_.theta_deg, last_.tcp_m);
  }
  if (is_adjacent && row.command == 0 && last_.command != 0) ticks_of_rest_ = kTicksOfRest;
  // The position of servos without power is no set-point of the motion that has ended: the motion rests where
  // it was held last.
  const bool is_led = row.follows_device() && ticks_of_rest_ > 0;
  if (!is_led) held_ = row;
  ticks_.add(held_.theta_deg, held_.tcp_m);
  if (row.command != 0 || ticks_of_rest_ > 0) ticks_.measure(row.cycle, motions_.back().peaks);
  ticks_of_rest_ = row.command == 0 && ticks_of_rest_ > 0 ? ticks_of_rest_ - 1 : 0;
}

void Recording::begin_motion(const Cycle& row, bool continuous) {
  const bool seen = std::any_of(motions_.begin(), motions_.end(), [&](const Motion& m) {
    return m.id == row.command && m.life_ns == lives_.back();
  });
  if (seen && continuous) fault(row, "a command that had ended runs again");
  Motion motion;
  motion.id = row.command;
  motion.life_ns = lives_.back();
  motion.first_ns = row.time_ns;
  motion.start_deg = have_last_ ? last_.theta_deg : row.theta_deg;
  motion.start_tcp_m = have_last_ ? last_.tcp_m : row.tcp_m;
  motion.knows_start = continuous;
  motion.whole = continuous;
  motions_.push_back(motion);
}

void Recording::follow(const Cycle& row, bool continuous) {
  Motion* running = !motions_.empty() && have_last_ && last_.command != 0 ? &motions_.back() : nullptr;
  if (running != nullptr && running->id != row.command) {
    running->end_deg = row.theta_deg;
    running->end_tcp_m = row.tcp_m;
    running->whole = running->whole && continuous && row.command == 0;
    if (continuous && row.command == 0) running->tcp_m.push_back(row.tcp_m);
  }
  const bool is_explained = row.follows_device() || last_.follows_device() || row.is_fault_stop;
  if (row.command == 0 && continuous && last_.command == 0 && !is_explained) {
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      const double moved_deg = std::abs(row.theta_deg[i] - last_.theta_deg[i]);
      if (moved_deg > kRounding_deg)
        fault(row, fmt::format("joint {} moves by {} degrees without a command", i, moved_deg));
    }
  }
  if (row.command != 0) {
    if (running == nullptr || running->id != row.command) begin_motion(row, continuous);
    Motion& motion = motions_.back();
    motion.last_ns = row.time_ns;
    motion.whole = motion.whole && continuous;
    motion.tcp_m.push_back(row.tcp_m);
  }
  measure(row);
}

}  // namespace corbot::soak
