// SPDX-License-Identifier: Apache-2.0
#include "planner/path_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "corbot/motion/law_evaluation.h"
#include "planner/refusal.h"

namespace corbot {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSmallestCell = 1e-9;       // of the path parameter
constexpr double kSmallestTravel_m = 1e-12;  // of TCP and tool together
constexpr std::size_t kMostCells = 20'000;   // a path that needs more runs along a border; it is refused
constexpr double kUnbroken_rad = 1e-3;       // θ0 may not change by more in a smallest cell
constexpr double kWrap_rad = 0.5;            // the others: next to a border, far more than √kSmallestCell
constexpr double kWrapMargin_rad = 1e-6;     // kept from ±180 degrees, where θ0, θ1 and θ3 wrap

struct Interval {
  double a, b;
};

double dot(double ax, double ay, double bx, double by) { return ax * bx + ay * by; }

}  // namespace

PathProof::PathProof(const ArmModel& model, const LineMotion& line, Branch branch, double hint_rad)
    : model_(&model), path_(line), branch_(branch), hint_rad_(hint_rad) {
  constants_.rotation = line.to_pitch_rad - line.from_pitch_rad;
  constants_.bend_m = 0.0;
  constants_.travel_m = length_m(line) + model.geometry.l3_m * std::abs(constants_.rotation);
}

PathProof::PathProof(const ArmModel& model, const ArcMotion& arc, Branch branch, double hint_rad)
    : model_(&model), path_(arc), branch_(branch), hint_rad_(hint_rad) {
  constants_.rotation = arc.to_pitch_rad - arc.from_pitch_rad;
  constants_.bend_m = arc.radius_m * arc.angle_rad * arc.angle_rad;
  constants_.travel_m = length_m(arc) + model.geometry.l3_m * std::abs(constants_.rotation);
}

PathPoint PathProof::point(double s) const noexcept {
  return std::visit([s](const auto& path) { return point_at(path, s); }, path_);
}

std::array<double, 3> PathProof::derivative(double s) const noexcept {
  std::array<double, 3> d{};
  if (const auto* line = std::get_if<LineMotion>(&path_)) {
    for (std::size_t i = 0; i < 3; ++i) d[i] = line->to_m[i] - line->from_m[i];
    return d;
  }
  const ArcMotion& arc = *std::get_if<ArcMotion>(&path_);
  const double speed = arc.radius_m * arc.angle_rad;
  const double cosine = speed * std::cos(s * arc.angle_rad);
  const double sine = speed * std::sin(s * arc.angle_rad);
  for (std::size_t i = 0; i < 3; ++i) d[i] = cosine * arc.v[i] - sine * arc.u[i];
  return d;
}

IkResult PathProof::joints_at(double s) const noexcept {
  const PathPoint p = point(s);
  return inverse(model_->geometry, p.position_m, p.pitch_rad, branch_, hint_rad_);
}

JointLimits PathProof::cut_limits(std::size_t joint) const noexcept {
  JointLimits limits = model_->joints[joint];
  limits.lower_q = std::max(limits.lower_q, -std::numbers::pi + kWrapMargin_rad);
  limits.upper_q = std::min(limits.upper_q, std::numbers::pi - kWrapMargin_rad);
  return limits;
}

bool PathProof::is_smallest(double s_a, double s_b) const noexcept {
  return s_b - s_a <= kSmallestCell || (s_b - s_a) * constants_.travel_m <= kSmallestTravel_m;
}

// Notation: w half width of the cell; index-free names are values in the middle; `d_name` bounds how far
// `name` strays from the middle, anywhere on the cell. Rounding is not directed: it is fourteen digits down,
// and the tolerances of reach (kBorderTolerance), range (kRangeTolerance_q) and speed (the stretch is
// rounded up) lie above it.
PathProof::Cell PathProof::bound(double s_a, double s_b) const noexcept {
  const ArmGeometry& arm = model_->geometry;
  const double s = 0.5 * (s_a + s_b);
  const double w = 0.5 * (s_b - s_a);
  const PathPoint p = point(s);
  const std::array<double, 3> v = derivative(s);
  const double rotation = constants_.rotation;
  const double facing = is_backward(branch_) ? -1.0 : 1.0;
  Cell cell;
  cell.middle = inverse(arm, p.position_m, p.pitch_rad, branch_, hint_rad_);
  cell.rate_bound.fill(kInfinity);
  if (cell.middle.status != IkStatus::kOk) return cell;

  // Base: θ0′ = (x y′ − y x′)/ρ².
  const auto [x, y, z] = p.position_m;
  const double rho = std::hypot(x, y);
  const double v_xy = std::hypot(v[0], v[1]);
  const double v_xy_top = v_xy + constants_.bend_m * w;
  const double rho_low = rho - v_xy_top * w;
  const double rho_high = rho + v_xy_top * w;
  if (rho_high <= kAxisTolerance_m) {
    cell.rate_bound[0] = 0.0;  // on the axis throughout: θ0 stays
  } else if (rho_low > 0.0) {
    const double cross = std::abs(x * v[1] - y * v[0]);
    cell.rate_middle[0] = cross / (rho * rho);
    cell.rate_bound[0] =
        std::min((cross + rho_high * constants_.bend_m * w) / (rho_low * rho_low), v_xy_top / rho_low);
  }

  // Wrist relative to the shoulder, (u, h), and its derivative.
  const double cos_pitch = std::cos(p.pitch_rad);
  const double sin_pitch = std::sin(p.pitch_rad);
  const double u = facing * rho - arm.l3_m * cos_pitch;
  const double h = z - arm.l0_m - arm.l3_m * sin_pitch;
  const double rho_rate = rho > 0.0 ? dot(x, y, v[0], v[1]) / rho : 0.0;
  const double v_u = facing * rho_rate + arm.l3_m * sin_pitch * rotation;
  const double v_h = v[2] - arm.l3_m * cos_pitch * rotation;
  const double bend = (constants_.bend_m + arm.l3_m * rotation * rotation) * w;
  // |ρ″| ≤ v_xy²/ρ + bend; nearer to the axis, ρ′ is known only to lie within ±v_xy.
  const double swing =
      rho_low > 0.0 ? std::min(v_xy_top * v_xy_top / rho_low * w, 2.0 * v_xy_top) : 2.0 * v_xy_top;
  const double d_v = std::hypot(swing + bend, bend);
  const double v_wrist_top = std::hypot(v_u, v_h) + d_v;

  // P² and from it the elbow: (2 L1 L2 sin θ2)² = far · near.
  const double p_wrist = cell.middle.wrist_distance_m;
  const double sum = cell.middle.max_m;
  const double difference = cell.middle.min_m;
  const double along = dot(u, h, v_u, v_h);
  const double d_along = v_wrist_top * v_wrist_top * w + p_wrist * d_v;
  const double d_square = 2.0 * w * (std::abs(along) + d_along);
  const double far = (sum - p_wrist) * (sum + p_wrist);
  const double near = (p_wrist - difference) * (p_wrist + difference);
  const double allowance = kBorderTolerance * sum * sum;  // half of what inverse() allows
  const double near_allowance = kBorderTolerance * sum * difference;
  cell.in_reach = far - d_square >= -allowance && near - d_square >= -near_allowance;
  const double far_low = far - d_square;
  const double near_low = near - d_square;
  const double twice = 2.0 * arm.l1_m * arm.l2_m;
  if (!(far > 0.0 && near > 0.0)) return cell;
  const double sine = std::sqrt(far * near) / twice;

  // From the wrist's velocity: A′ = −(u′ cos B + h′ sin B)/(L1 sin θ2),
  //                            B′ = (u′ cos A + h′ sin A)/(L2 sin θ2).
  const auto [a, b, c] = detail::inclinations(arm, cell.middle.position_q);
  const double top_a = dot(v_u, v_h, std::cos(b), std::sin(b));
  const double top_b = dot(v_u, v_h, std::cos(a), std::sin(a));
  const double sign = is_negative(branch_) ? -1.0 : 1.0;
  const double a_rate = -sign * top_a / (arm.l1_m * sine);
  const double b_rate = sign * top_b / (arm.l2_m * sine);
  const double elbow_rate = -sign * along / (arm.l1_m * arm.l2_m * sine);
  cell.rate_middle[1] = std::abs(a_rate);
  cell.rate_middle[2] = std::abs(elbow_rate);
  cell.rate_middle[3] = std::abs(rotation - b_rate);
  if (!(far_low > 0.0 && near_low > 0.0)) return cell;

  const double sine_low = std::sqrt(far_low * near_low) / twice;
  const double sine_high = std::sqrt((far + d_square) * (near + d_square)) / twice;
  const double d_inverse = 1.0 / sine_low - 1.0 / sine_high;  // of 1/sin θ2
  const double d_angle_a = std::min(2.0, w * v_wrist_top / (arm.l1_m * sine_low));
  const double d_angle_b = std::min(2.0, w * v_wrist_top / (arm.l2_m * sine_low));
  const double d_a = ((d_v + v_wrist_top * d_angle_b) / sine_low + std::abs(top_a) * d_inverse) / arm.l1_m;
  const double d_b = ((d_v + v_wrist_top * d_angle_a) / sine_low + std::abs(top_b) * d_inverse) / arm.l2_m;
  const double d_elbow = (d_along / sine_low + std::abs(along) * d_inverse) / (arm.l1_m * arm.l2_m);
  cell.rate_bound[1] = cell.rate_middle[1] + d_a;
  cell.rate_bound[2] = cell.rate_middle[2] + std::min(d_elbow, d_a + d_b);
  cell.rate_bound[3] = cell.rate_middle[3] + d_b;
  return cell;
}

std::optional<PlanRefusal> PathProof::check_ends(double s_a, double s_b) const {
  const IkResult a = joints_at(s_a);
  const IkResult b = joints_at(s_b);
  for (const IkResult* end : {&a, &b}) {
    if (end->status != IkStatus::kOk) {
      return unreachable(point(end == &a ? s_a : s_b).position_m, *end, "the path's point");
    }
  }
  // Where a joint is fast, a smallest cell can step over the whole margin at ±180 degrees:
  // a wrap, not a travel.
  for (std::size_t i = 1; i < 4; ++i) {
    if (std::abs(a.position_q[i] - b.position_q[i]) <= kWrap_rad) continue;
    PlanRefusal refusal = joint_range(static_cast<int>(i), std::copysign(std::numbers::pi, a.position_q[i]),
                                      cut_limits(i), fmt::format("{:.3g} % along the path", 100.0 * s_a));
    refusal.target_m = point(s_a).position_m;
    return refusal;
  }
  // On the axis θ0 is the hint; a path that leaves the axis in the arm's own direction is unbroken.
  if (std::abs(a.position_q[0] - b.position_q[0]) <= kUnbroken_rad) return std::nullopt;
  PlanRefusal refusal;
  refusal.kind = PlanRefusal::Kind::kUnreachable;
  refusal.parameter = "P";
  refusal.joint = 0;
  refusal.target_m = point(s_b).position_m;
  refusal.text = fmt::format("the path leads through the base axis at z = {:.6g} m, where joint 0 would jump",
                             refusal.target_m[2]);
  return refusal;
}

std::optional<PlanRefusal> PathProof::check_geometry() const {
  std::vector<Interval> open{{0.0, 1.0}};
  for (std::size_t count = 0; !open.empty(); ++count) {
    const auto [s_a, s_b] = open.back();
    open.pop_back();
    const Cell cell = bound(s_a, s_b);
    const double s = 0.5 * (s_a + s_b);
    if (cell.middle.status != IkStatus::kOk)
      return unreachable(point(s).position_m, cell.middle, "the path's point");
    bool proved = cell.in_reach;
    for (std::size_t i = 0; i < 4; ++i) {
      const JointLimits limits = cut_limits(i);
      const double q = cell.middle.position_q[i];
      if (!in_range(limits, q)) {
        PlanRefusal refusal =
            joint_range(static_cast<int>(i), q, limits, fmt::format("{:.3g} % along the path", 100.0 * s));
        refusal.target_m = point(s).position_m;
        return refusal;
      }
      const double stray = cell.rate_bound[i] * 0.5 * (s_b - s_a);
      proved = proved && in_range(limits, q - stray) && in_range(limits, q + stray);
    }
    if (proved) continue;
    if (is_smallest(s_a, s_b)) {
      if (auto refusal = check_ends(s_a, s_b)) return refusal;
      continue;
    }
    if (count >= kMostCells) {
      PlanRefusal refusal;
      refusal.kind = PlanRefusal::Kind::kLimitExceeded;
      refusal.parameter = "path";
      refusal.target_m = point(s).position_m;
      refusal.text = "the path runs along the border of the workspace too closely to be proved within it";
      return refusal;
    }
    open.push_back({s, s_b});
    open.push_back({s_a, s});
  }
  return std::nullopt;
}

double PathProof::Clock::s(double x) const noexcept {
  return law != nullptr ? evaluate(*law, x * law->duration_s()).position : x;
}
double PathProof::Clock::rate(double x) const noexcept {
  return law != nullptr ? evaluate(*law, x * law->duration_s()).velocity : 1.0;
}
double PathProof::Clock::top_rate(double x_a, double x_b) const noexcept {
  // The law's speed rises to its middle and falls after it.
  return rate(x_b < 0.5 ? x_b : std::max(x_a, 0.5));
}

double PathProof::bound_load(const Clock& clock, const Joints& speed, double floor, double give_up,
                             bool sample_singular) const {
  constexpr int kFirstCells = 16;  // so that the floor is near the truth before cells are judged against it
  std::vector<Interval> open;
  double known = 0.0;  // the load at points of the path: a lower bound
  double proved = floor;
  for (int i = kFirstCells; i-- > 0;) {
    open.push_back({static_cast<double>(i) / kFirstCells, static_cast<double>(i + 1) / kFirstCells});
  }
  bool warm_up = true;
  for (std::size_t count = 0; !open.empty();) {
    if (warm_up) {
      for (const auto& [x_a, x_b] : open) {
        const double x = 0.5 * (x_a + x_b);
        const double s = clock.s(x);
        const Cell cell = bound(s, s);
        for (std::size_t i = 0; i < 4; ++i) {
          known = std::max(known, cell.rate_middle[i] * clock.rate(x) / speed[i]);
        }
      }
      warm_up = false;
    }
    if (known > give_up || ++count > kMostCells) return kInfinity;
    const auto [x_a, x_b] = open.back();
    open.pop_back();
    const double s_a = clock.s(x_a);
    const double s_b = clock.s(x_b);
    if (!(s_b > s_a)) continue;
    const double top = clock.top_rate(x_a, x_b);
    const Cell cell = bound(s_a, s_b);
    double cell_bound = 0.0;
    for (std::size_t i = 0; i < 4; ++i)
      cell_bound = std::max(cell_bound, cell.rate_bound[i] * top / speed[i]);
    if (cell_bound <= std::max(floor, 1.01 * known)) {
      proved = std::max(proved, cell_bound);
      continue;
    }
    if (is_smallest(s_a, s_b)) {
      if (!sample_singular) return kInfinity;
      const IkResult a = joints_at(s_a);
      const IkResult b = joints_at(s_b);
      for (std::size_t i = 0; i < 4; ++i) {
        const double mean = std::abs(a.position_q[i] - b.position_q[i]) / (s_b - s_a);
        proved = std::max(proved, mean * top / speed[i]);
      }
      continue;
    }
    const double x = 0.5 * (x_a + x_b);
    // The middle of the cell in s is not its middle in x; its speed there is at least that of the slower end.
    const double least = std::min(clock.rate(x_a), clock.rate(x_b));
    for (std::size_t i = 0; i < 4; ++i) known = std::max(known, cell.rate_middle[i] * least / speed[i]);
    open.push_back({x, x_b});
    open.push_back({x_a, x});
  }
  return proved;
}

double PathProof::load(const TimeLaw& law, const Joints& joint_speed_q_s, double floor) const {
  return bound_load({&law}, joint_speed_q_s, floor, kInfinity, true);
}

double PathProof::unit_load(const Joints& joint_speed_q_s, double give_up) const {
  return bound_load({nullptr}, joint_speed_q_s, 0.0, give_up, false);
}

}  // namespace corbot
