// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <numbers>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "config/arms/recognise.h"
#include "corbot/kinematics/spherical_wrist.h"

namespace corbot::config {
namespace {

/// Describes the failure of a condition, or returns "" if it holds. In the texts joints count from 1.
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
  /// Checks that axis k goes through the crossing of i and i + 1.
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

std::string first_of(std::initializer_list<std::string> failures,
                     const char* otherwise = "its links or slides are degenerate") {
  for (const std::string& failure : failures) {
    if (!failure.empty()) return failure;
  }
  return otherwise;
}

std::string kinds(const JointChain& chain) {
  std::string text;
  for (std::size_t i = 0; i < chain.count; ++i) text += chain.axes[i].kind == JointKind::kRotary ? 'R' : 'P';
  return text;
}

/// Returns why a family does not accept axes with the right kinds of joints, as far as this file knows the
/// reason.
template <class Form>
std::string why_not(const Conditions& c, const std::string& joints) {
  const std::size_t count = joints.size();
  if constexpr (std::is_same_v<Form, PlanarArm>) {
    const bool wrist = count > 3, roll = count > 4;
    return first_of({c.square(1, 2), c.parallel(2, 3), c.apart(2, 3), wrist ? c.parallel(3, 4) : "",
                     wrist ? c.apart(3, 4) : "", roll ? c.square(4, 5) : ""});
  } else if constexpr (std::is_same_v<Form, ScaraArm>) {
    return first_of({c.parallel(1, 2), c.parallel(1, 3), count > 3 ? c.parallel(1, 4) : ""});
  } else if constexpr (std::is_same_v<Form, GantryArm>) {
    return "its slides lie in one plane";
  } else if constexpr (std::is_same_v<Form, CylindricalArm>) {
    const std::string hand = count > 3 ? c.parallel(1, 4) : "";
    return c.parallel(1, 2).empty() ? first_of({c.square(1, 3), hand})
                                    : first_of({c.parallel(1, 3), c.square(1, 2), hand});
  } else if constexpr (std::is_same_v<Form, PolarArm>) {
    const std::string arm = first_of({c.square(1, 2), c.square(2, 3)}, "");
    return count == 3
               ? first_of({arm})
               : first_of({arm, c.square(4, 5), c.square(5, 6), c.crossing(4, 5), c.through_crossing(4, 6)});
  } else if constexpr (std::is_same_v<Form, OrthoParallelArm>) {
    return first_of({c.square(1, 2), c.parallel(2, 3), c.apart(2, 3), c.square(4, 5), c.square(5, 6),
                     c.crossing(4, 5), c.through_crossing(4, 6)});
  } else if constexpr (std::is_same_v<Form, ParallelAxesArm>) {
    return first_of({c.square(1, 2), c.parallel(2, 3), c.parallel(3, 4), c.apart(2, 3), c.apart(3, 4),
                     c.square(4, 5), c.square(5, 6), c.crossing(5, 6)});
  } else {
    return "its axes are not placed as this family needs them";
  }
}

bool has_joints(const std::string& words, const std::string& joints) {
  std::istringstream in(words);
  for (std::string word; in >> word;) {
    if (word == joints) return true;
  }
  return false;
}

template <class Form>
void explain(const Conditions& c, const std::string& joints, std::string& text) {
  if (!has_joints(Form::kJoints, joints)) return;
  text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", Form::kName, why_not<Form>(c, joints));
}

}  // namespace

std::string explain_other(const JointChain& chain) {
  const std::string joints = kinds(chain);
  const Conditions c(chain);
  std::string text;
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (explain<std::variant_alternative_t<I, Families>>(c, joints, text), ...);
  }
  (std::make_index_sequence<std::variant_size_v<Families>>{});
  return text.empty() ? fmt::format("no family has joints {} (R turning, P sliding)", joints) : text;
}

}  // namespace corbot::config
