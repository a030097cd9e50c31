// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/regularity.h"

#include <Eigen/SVD>

namespace corbot::cli {

Regularity regularity_at(const Kinematics& arm, const Joints& q) {
  const Jacobian jacobian = arm.jacobian(q);
  const FollowedAngles followed = arm.followed();
  // For an arm of fewer than six joints without a closed form, all six components of the tool's motion count.
  const bool by_angles = arm.follows() != Follows::kFull && 3 + followed.count == arm.joint_count();
  const auto columns = static_cast<Eigen::Index>(arm.joint_count());
  const Eigen::Index rows = by_angles ? columns : 6;
  Eigen::MatrixXd task(rows, columns);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const auto row = static_cast<std::size_t>(k);
    for (Eigen::Index i = 0; i < columns; ++i) {
      const auto joint = static_cast<std::size_t>(i);
      task(k, i) = by_angles && row >= 3 ? followed.rows[row - 3][joint] : jacobian[row][joint];
    }
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(task, Eigen::ComputeFullV);
  Regularity result;
  result.smallest = svd.singularValues()(columns - 1);
  for (Eigen::Index i = 0; i < columns; ++i)
    result.idle_q_s[static_cast<std::size_t>(i)] = svd.matrixV()(i, columns - 1);
  return result;
}

}  // namespace corbot::cli
