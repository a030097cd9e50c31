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

constexpr double kRounding_deg = 3e-9;  // of two recorded angles
constexpr double kRounding_m = 3e-12;

double distance_m(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace

bool Recording::parse(const std::string& line, Row& row) {
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
  for (std::size_t i = 0; i < 4; ++i) row.theta_deg[i] = std::strtod(words[6 + i].c_str(), nullptr);
  for (std::size_t i = 0; i < 3; ++i) row.tcp_m[i] = std::strtod(words[10 + i].c_str(), nullptr);
  return true;
}

void Recording::read(const std::string& line) {
  if (line.starts_with("cycle,")) {
    have_last_ = false;
    is_new_life_ = true;
    return;
  }
  Row row;
  if (!parse(line, row)) return;
  if (std::exchange(is_new_life_, false)) life_ns_ = row.time_ns;
  ++cycles_;
  // A task that is killed while it writes leaves one slot of the flight recorder unreadable.
  const bool continuous = have_last_ && row.cycle > last_.cycle && row.cycle - last_.cycle <= 2;
  if (have_last_ && !continuous) ++gaps_;
  constexpr std::int64_t kSilence_ns = 500'000'000;
  if (last_ns_ != 0 && row.time_ns - last_ns_ > kSilence_ns) silences_.push_back({last_ns_, row.time_ns});
  constexpr std::int64_t kPause_ns = 90'000'000;
  if (continuous && row.time_ns - last_.time_ns > kPause_ns) pauses_.push_back({last_.time_ns, row.time_ns});
  last_ns_ = row.time_ns;
  check(row);
  follow(row, continuous);
  last_ = row;
  have_last_ = true;
}

void Recording::fault(const Row& row, const std::string& text) {
  if (faults_.size() < 100)
    faults_.push_back(fmt::format("cycle {} ({}, command {}): {}", row.cycle, row.state, row.command, text));
}

void Recording::check(const Row& row) {
  const double period_s = static_cast<double>(arm_.period_ns) * 1e-9;
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    const JointLimits& limits = arm_.joints[i];
    const double lower_deg = to_degrees(limits.lower_rad) - kRounding_deg;
    const double upper_deg = to_degrees(limits.upper_rad) + kRounding_deg;
    if (!(row.theta_deg[i] >= lower_deg && row.theta_deg[i] <= upper_deg))
      fault(row, fmt::format("joint {} at {} degrees, allowed {} to {}", i, row.theta_deg[i], lower_deg,
                             upper_deg));
    // Also across cycles that were not recorded: a cycle is counted, or the arm stood still.
    if (!have_last_ || row.cycle <= last_.cycle) continue;
    const double cycles = static_cast<double>(row.cycle - last_.cycle);
    const double step_deg = std::abs(row.theta_deg[i] - last_.theta_deg[i]);
    const double allowed_deg =
        to_degrees(limits.speed_rad_s) * period_s * cycles * (1.0 + 1e-6) + kRounding_deg;
    if (step_deg > allowed_deg)
      fault(row,
            fmt::format("joint {} by {} degrees in {} cycles, allowed {}", i, step_deg, cycles, allowed_deg));
  }
}

void Recording::follow(const Row& row, bool continuous) {
  const double period_s = static_cast<double>(arm_.period_ns) * 1e-9;
  Motion* running = !motions_.empty() && have_last_ && last_.command != 0 ? &motions_.back() : nullptr;
  if (running != nullptr && running->id != row.command) {
    running->end_deg = row.theta_deg;
    running->end_tcp_m = row.tcp_m;
    running->whole = running->whole && continuous && row.command == 0;
  }
  if (row.command == 0) {
    if (continuous && last_.command == 0) {
      for (std::size_t i = 0; i < arm_.dof; ++i) {
        const double moved_deg = std::abs(row.theta_deg[i] - last_.theta_deg[i]);
        if (moved_deg > kRounding_deg)
          fault(row, fmt::format("joint {} moves by {} degrees without a command", i, moved_deg));
      }
    }
    return;
  }
  if (running == nullptr || running->id != row.command) {
    const auto seen = std::find_if(motions_.begin(), motions_.end(), [&](const Motion& m) {
      return m.id == row.command && m.life_ns == life_ns_;
    });
    if (seen != motions_.end() && continuous) fault(row, "a command that had ended runs again");
    Motion motion;
    motion.id = row.command;
    motion.life_ns = life_ns_;
    motion.first_ns = row.time_ns;
    motion.start_deg = have_last_ ? last_.theta_deg : row.theta_deg;
    motion.whole = continuous;
    motions_.push_back(motion);
    running = &motions_.back();
  }
  running->last_ns = row.time_ns;
  running->whole = running->whole && continuous;
  if (continuous) {
    const double cycles = static_cast<double>(row.cycle - last_.cycle);
    const double speed_m_s = (distance_m(row.tcp_m, last_.tcp_m) - kRounding_m) / (period_s * cycles);
    running->worst_tool_m_s = std::max(running->worst_tool_m_s, speed_m_s);
  }
}

}  // namespace corbot::soak
