// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <numbers>
#include <string>
#include <string_view>

#include "config/arms/recognise.h"
#include "corbot/kinematics/spherical_wrist.h"

namespace corbot::config {
namespace {

/// A condition's failure in words, empty where it holds. Joints count from 1 in what is said.
class Conditions {
 public:
  explicit Conditions(const JointChain& chain) : axes_(chain.axes) {}

  [[nodiscard]] std::string parallel(std::size_t i, std::size_t k) const {
    return corbot::parallel(direction(i), direction(k))
               ? ""
               : fmt::format("axes {} and {} are not parallel ({})", i, k, angle(i, k));
  }
  [[nodiscard]] std::string square(std::size_t i, std::size_t k) const {
    return corbot::square(direction(i), direction(k))
               ? ""
               : fmt::format("axes {} and {} are not square to each other ({})", i, k, angle(i, k));
  }
  [[nodiscard]] std::string crossing(std::size_t i, std::size_t k) const {
    return corbot::crossing(axes_[i - 1], axes_[k - 1])
               ? ""
               : fmt::format("axes {} and {} do not cross ({:.4g} m apart)", i, k, apart_m(i, k));
  }
  /// Whether axis k passes the crossing of i and i + 1.
  [[nodiscard]] std::string through_crossing(std::size_t i, std::size_t k) const {
    const auto centre = corbot::crossing(axes_[i - 1], axes_[i]);
    if (!centre) return crossing(i, i + 1);
    const Vector3 away = axes_[k - 1].point_m - *centre;
    const double distance_m = norm(cross(away, direction(k)));
    return distance_m <= kRecognised
               ? ""
               : fmt::format("axis {} passes the crossing of axes {} and {} at {:.4g} m", k, i, i + 1,
                             distance_m);
  }
  [[nodiscard]] std::string apart(std::size_t i, std::size_t k) const {
    return apart_m(i, k) > kRecognised ? "" : fmt::format("axes {} and {} are the same line", i, k);
  }

 private:
  [[nodiscard]] const Vector3& direction(std::size_t i) const { return axes_[i - 1].direction; }
  [[nodiscard]] std::string angle(std::size_t i, std::size_t k) const {
    const double rad = std::atan2(norm(cross(direction(i), direction(k))), dot(direction(i), direction(k)));
    return fmt::format("{:.6g} degrees", rad * 180.0 / std::numbers::pi);
  }
  [[nodiscard]] double apart_m(std::size_t i, std::size_t k) const {
    const Vector3 n = cross(direction(i), direction(k));
    const Vector3 away = axes_[k - 1].point_m - axes_[i - 1].point_m;
    if (norm(n) < kRecognised) return norm(cross(away, direction(i)));
    return std::abs(dot(away, n)) / norm(n);
  }

  std::array<JointAxis, kMaxJoints> axes_;
};

std::string first_of(std::initializer_list<std::string> failures) {
  for (const std::string& failure : failures) {
    if (!failure.empty()) return failure;
  }
  return "its links or slides are degenerate";
}

std::string kinds(const JointChain& chain) {
  std::string text;
  for (std::size_t i = 0; i < chain.count; ++i) text += chain.axes[i].kind == JointKind::kRotary ? 'R' : 'P';
  return text;
}

std::string planar(const Conditions& c, std::size_t count) {
  const bool wrist = count > 3, roll = count > 4;
  return first_of({c.square(1, 2), c.parallel(2, 3), c.apart(2, 3), wrist ? c.parallel(3, 4) : "",
                   wrist ? c.apart(3, 4) : "", roll ? c.square(4, 5) : ""});
}
std::string six_turning(const Conditions& c) {
  const std::string wrist = first_of({c.square(1, 2), c.parallel(2, 3), c.apart(2, 3), c.square(4, 5),
                                      c.square(5, 6), c.crossing(4, 5), c.through_crossing(4, 6)});
  const std::string parallel = first_of({c.square(1, 2), c.parallel(2, 3), c.parallel(3, 4), c.apart(2, 3),
                                         c.apart(3, 4), c.square(4, 5), c.square(5, 6), c.crossing(5, 6)});
  return fmt::format("{}: {}; {}: {}", OrthoParallelArm::kName, wrist, ParallelAxesArm::kName, parallel);
}

}  // namespace

std::string explain_other(const JointChain& chain) {
  const std::string joints = kinds(chain);
  const Conditions c(chain);
  const auto named = [](const char* family, const std::string& why) {
    return fmt::format("{}: {}", family, why);
  };
  if (joints == "RRR" || joints == "RRRR" || joints == "RRRRR") {
    return named(PlanarArm::kName, planar(c, chain.count));
  }
  if (joints == "RRRRRR") return six_turning(c);
  if (joints == "PPP" || joints == "PPPR") return named(GantryArm::kName, "its slides lie in one plane");
  if (joints == "RPP") {
    return named(CylindricalArm::kName, c.parallel(1, 2).empty()
                                            ? first_of({c.square(1, 3)})
                                            : first_of({c.parallel(1, 3), c.square(1, 2)}));
  }
  if (joints == "RPPR") {
    return named(CylindricalArm::kName, c.parallel(1, 2).empty()
                                            ? first_of({c.square(1, 3), c.parallel(1, 4)})
                                            : first_of({c.parallel(1, 3), c.square(1, 2), c.parallel(1, 4)}));
  }
  if (joints == "RRPRRR") {
    return named(PolarArm::kName, first_of({c.square(1, 2), c.square(2, 3), c.square(4, 5), c.square(5, 6),
                                            c.crossing(4, 5), c.through_crossing(4, 6)}));
  }
  const std::string scara = chain.count == 3 ? first_of({c.parallel(1, 2), c.parallel(1, 3)})
                            : chain.count == 4
                                ? first_of({c.parallel(1, 2), c.parallel(1, 3), c.parallel(1, 4)})
                                : std::string{};
  if (joints == "RRP") {
    return fmt::format("{}: {}; {}: {}", PolarArm::kName, first_of({c.square(1, 2), c.square(2, 3)}),
                       ScaraArm::kName, scara);
  }
  for (const std::string_view one : {"RPR", "PRR", "RRPR", "RPRR", "PRRR", "RRRP"}) {
    if (joints == one) return named(ScaraArm::kName, scara);
  }
  return fmt::format("no family has joints {} (R turning, P sliding)", joints);
}

}  // namespace corbot::config
