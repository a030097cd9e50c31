// SPDX-License-Identifier: Apache-2.0
#include "support/path_log.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <utility>

#include "corbot/kinematics/tool_pose.h"
#include "shm/channel_client.h"

namespace corbot::test {
namespace {

constexpr double kServoFrame_s = 0.020;
constexpr double kLatePeriods = 3.0;   // behind by more is late
constexpr double kMostKeptBack = 3.0;  // times as long as a frame that was not
constexpr double kLongestCycle = 5.0;  // periods; after a longer gap the motion begins again from rest

using Point = std::array<double, 3>;

double distance_m(const Point& a, const Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// Returns the distance of `p` from the straight piece between two set-points.
double distance_m(const Point& p, const Point& a, const Point& b) {
  double along = 0.0;
  double length2 = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    along += (p[i] - a[i]) * (b[i] - a[i]);
    length2 += (b[i] - a[i]) * (b[i] - a[i]);
  }
  const double share = length2 > 0.0 ? std::clamp(along / length2, 0.0, 1.0) : 0.0;
  Point nearest{};
  for (std::size_t i = 0; i < 3; ++i) nearest[i] = a[i] + share * (b[i] - a[i]);
  return distance_m(p, nearest);
}

double half_a_unit_q(const ArmModel& arm, const DeviceFacts& facts, std::size_t joint) {
  // A hundredth of a microsecond is lost in a record of pulses.
  return facts.takes_joints ? 0.5 * facts.unit : (0.5 * facts.unit + 0.006) / arm.servos[joint].us_per_q;
}

/// The furthest that half a unit at every joint can move the TCP.
double quantisation_m(const ArmModel& arm, const DeviceFacts& facts, const Joints& at) {
  const Point middle = tool_pose(arm.kinematics, at).position_m;
  double sum_m = 0.0;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    Joints beside = at;
    beside[i] += half_a_unit_q(arm, facts, i);
    sum_m += distance_m(middle, tool_pose(arm.kinematics, beside).position_m);
  }
  return sum_m;
}

/// The largest speed of the TCP on the path, in m/s.
double speed(const std::vector<Snapshot>& path) {
  double worst = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double dt_s = static_cast<double>(path[i].time_ns - path[i - 1].time_ns) * 1e-9;
    worst = std::max(worst, distance_m(path[i].tool.position_m, path[i - 1].tool.position_m) / dt_s);
  }
  return worst;
}

/// The median time between two set-points, in s.
double period_s(const std::vector<Snapshot>& path) {
  std::vector<std::int64_t> periods_ns;
  for (std::size_t i = 1; i < path.size(); ++i) periods_ns.push_back(path[i].time_ns - path[i - 1].time_ns);
  if (periods_ns.empty()) return 1.0;
  const auto middle = periods_ns.begin() + static_cast<std::ptrdiff_t>(periods_ns.size() / 2);
  std::nth_element(periods_ns.begin(), middle, periods_ns.end());
  return static_cast<double>(*middle) * 1e-9;
}

/// The largest acceleration of the TCP on the path, in m/s2. A set-point is one period ahead of the previous
/// one, however late its cycle began.
double acceleration(const std::vector<Snapshot>& path) {
  constexpr std::size_t kStride = 3;  // cycles of 4 or 5 ms
  const double dt_s = static_cast<double>(kStride) * period_s(path);
  double worst = 0.0;
  for (std::size_t i = 2 * kStride; i < path.size(); ++i) {
    const Snapshot& a = path[i - 2 * kStride];
    const Snapshot& b = path[i - kStride];
    const Snapshot& c = path[i];
    Point second{};
    for (std::size_t k = 0; k < 3; ++k)
      second[k] = a.tool.position_m[k] - 2.0 * b.tool.position_m[k] + c.tool.position_m[k];
    worst = std::max(worst, distance_m(second, {}) / (dt_s * dt_s));
  }
  return worst;
}

bool is_before(const Snapshot& snapshot, std::int64_t time_ns) { return snapshot.time_ns < time_ns; }

/// Measures how far the path was ahead of a device, lately: the time without an output while the path went
/// on, or the lag of an output. A rest is neither.
class Lateness {
 public:
  explicit Lateness(const std::vector<Snapshot>& path)
      : path_(path), longest_cycle_s_(kLongestCycle * period_s(path)) {}
  double longest_s(std::int64_t now_ns, std::int64_t passed_ns) {
    const double gap_s = last_ns_ != 0 ? moving_s(last_ns_, now_ns) : 0.0;
    late_.emplace_back(now_ns, std::max(gap_s, moving_s(passed_ns, now_ns)));
    last_ns_ = now_ns;
    const auto is_caught_up = [&](const auto& late) {
      return static_cast<double>(now_ns - late.first) * 1e-9 > kCaughtUp_s + late.second;
    };
    while (!late_.empty() && is_caught_up(late_.front())) late_.pop_front();
    double longest_s = 0.0;
    for (const auto& [time_ns, late_s] : late_) longest_s = std::max(longest_s, late_s);
    return longest_s;
  }

 private:
  static constexpr double kCaughtUp_s = 0.050;
  static constexpr double kStill_m = 1e-8;

  [[nodiscard]] double moving_s(std::int64_t from_ns, std::int64_t to_ns) const {
    double sum_s = 0.0;
    const auto end = std::lower_bound(path_.begin(), path_.end(), to_ns, is_before);
    auto point = std::lower_bound(path_.begin(), path_.end(), from_ns, is_before);
    if (point == path_.begin() && point != end) ++point;
    for (; point != end; ++point) {
      const Snapshot& before = *std::prev(point);
      if (distance_m(point->tool.position_m, before.tool.position_m) < kStill_m) continue;
      sum_s += std::min(static_cast<double>(point->time_ns - before.time_ns) * 1e-9, longest_cycle_s_);
    }
    return sum_s;
  }

  const std::vector<Snapshot>& path_;
  const double longest_cycle_s_;
  std::int64_t last_ns_{0};
  std::deque<std::pair<std::int64_t, double>> late_;  ///< when, by how much
};

double joint_of(const ArmModel& arm, const DeviceFacts& facts, const Output& output) {
  if (facts.takes_joints) return output.value;
  const ServoMap& map = arm.servos[output.servo];
  return (output.value - map.zero_us) / (map.direction * map.us_per_q);
}

}  // namespace

PathLog::PathLog(const std::string& robot) : robot_(robot), thread_([this] { follow(); }) {}

PathLog::~PathLog() {
  end_ = true;
  if (thread_.joinable()) thread_.join();
}

void PathLog::follow() {
  const Observer channel = Observer::of(robot_);
  const Trace& trace = channel.task().trace;
  std::uint64_t next = trace.next();
  for (bool last = false; !last;) {
    last = end_;
    for (const std::uint64_t until = trace.next(); next < until; ++next) {
      Snapshot snapshot{};
      if (trace.read(next, snapshot)) {
        path_.push_back(snapshot);
      } else {
        ++lost_;
      }
    }
    const timespec pause{0, 50'000'000};
    if (!last) ::nanosleep(&pause, nullptr);
  }
}

const std::vector<Snapshot>& PathLog::finish() {
  end_ = true;
  thread_.join();
  if (lost_ > 0) throw std::runtime_error(std::to_string(lost_) + " cycles were missed");
  return path_;
}

Following following(const ArmModel& arm, const std::vector<Snapshot>& path,
                    const std::vector<Output>& outputs, const DeviceFacts& facts, double window_s) {
  Following result;
  Joints at{};
  std::vector<bool> known(arm.dof, false);
  // In cycles: a frame that waited while the machine stood still is no older, however long that was.
  const auto window_cycles = std::lround(window_s / period_s(path));
  // A device that gets fewer frames than its servos could take interpolates: it cuts the corners of the path.
  const double acceleration_m = acceleration(path);
  const auto chord_m = [&](double time_s) { return acceleration_m * time_s * time_s / 8.0; };
  const double corner_m = facts.period_s > kServoFrame_s ? chord_m(facts.period_s) : 0.0;
  const double speed_m_s = speed(path);
  std::int64_t last_ns = 0;
  Lateness lateness(path);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (outputs[i].servo < arm.dof) {
      at[outputs[i].servo] = joint_of(arm, facts, outputs[i]);
      known[outputs[i].servo] = true;
    }
    const bool is_last_of_instant = i + 1 == outputs.size() || outputs[i + 1].time_ns != outputs[i].time_ns;
    const std::int64_t now_ns = outputs[i].time_ns;
    if (!is_last_of_instant || std::count(known.begin(), known.end(), true) != arm.dof) continue;
    const auto last = std::lower_bound(path.begin(), path.end(), now_ns, is_before);
    if (last - path.begin() <= window_cycles) continue;  // before the log began
    const Point tcp = tool_pose(arm.kinematics, at).position_m;
    double nearest_m = HUGE_VAL;
    std::int64_t passed_ns = now_ns;
    for (auto point = last - window_cycles; point != last; ++point) {
      const double distance = distance_m(tcp, std::prev(point)->tool.position_m, point->tool.position_m);
      if (distance > nearest_m) continue;
      nearest_m = distance;
      passed_ns = point->time_ns;
    }
    ++result.outputs;
    // If servos do not start together, some are one frame ahead. After a frame that was kept back, they are
    // also ahead by its way.
    const double since_s = static_cast<double>(now_ns - std::exchange(last_ns, now_ns)) * 1e-9;
    const double skew_s = std::clamp(since_s, facts.skew_s, kMostKeptBack * facts.skew_s);
    const double allowed_m = quantisation_m(arm, facts, at) + corner_m + speed_m_s * skew_s;
    result.deviation_m = std::max(result.deviation_m, nearest_m);
    result.quantisation_m = std::max(result.quantisation_m, allowed_m);
    // A late loop goes straight to where the arm should be.
    const double late_s = lateness.longest_s(now_ns, passed_ns);
    const double late_m = late_s > kLatePeriods * facts.period_s ? chord_m(late_s) : 0.0;
    result.beyond_m = std::max(result.beyond_m, nearest_m - allowed_m - late_m);
  }
  return result;
}

}  // namespace corbot::test
