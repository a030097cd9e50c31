// SPDX-License-Identifier: Apache-2.0
#include "config/arms/urdf_chain.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

namespace corbot::config {
namespace {

constexpr double kFarthestOrigin_m = 100.0;  // the same limit as for a base frame

/// Returns false also for values that are not finite.
bool is_near(const Pose& frame) { return is_finite(frame) && norm(frame.position_m) <= kFarthestOrigin_m; }

/// Stores the first error of urdfdom, instead of printing it, during its lifetime.
class CaughtMessages final : public console_bridge::OutputHandler {
 public:
  CaughtMessages() { console_bridge::useOutputHandler(this); }
  CaughtMessages(const CaughtMessages&) = delete;
  CaughtMessages& operator=(const CaughtMessages&) = delete;
  ~CaughtMessages() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char* /*file*/,
           int /*line*/) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && first_.empty()) first_ = text;
  }
  [[nodiscard]] const std::string& first() const noexcept { return first_; }

 private:
  std::string first_;
};

urdf::ModelInterfaceSharedPtr parse(const std::string& xml) {
  CaughtMessages messages;
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(xml);
  } catch (const std::exception& error) {  // an invalid number
    throw UrdfError(fmt::format("is no URDF: {}", error.what()));
  }
  if (model == nullptr) {
    throw UrdfError(fmt::format("is no URDF: {}", messages.first().empty() ? "not XML" : messages.first()));
  }
  return model;
}

Pose pose_of(const urdf::Pose& given) {
  const urdf::Rotation& q = given.rotation;
  return {{given.position.x, given.position.y, given.position.z}, normalised({q.w, q.x, q.y, q.z})};
}

/// Returns the joints from base to tip.
std::vector<urdf::JointSharedPtr> joints_between(const urdf::ModelInterface& model, const std::string& base,
                                                 const std::string& tip) {
  for (const std::string& link : {base, tip}) {
    if (model.getLink(link) == nullptr) throw UrdfError(fmt::format("has no link \"{}\"", link));
  }
  std::vector<urdf::JointSharedPtr> joints;
  for (urdf::LinkConstSharedPtr link = model.getLink(tip); link->name != base;) {
    const urdf::JointSharedPtr joint = link->parent_joint;
    if (joint == nullptr) {
      throw UrdfError(
          fmt::format("has no chain of joints from link \"{}\" outwards to link \"{}\"", base, tip));
    }
    joints.push_back(joint);
    link = model.getLink(joint->parent_link_name);
  }
  std::reverse(joints.begin(), joints.end());
  return joints;
}

JointKind kind_of(const urdf::Joint& joint) {
  switch (joint.type) {
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS:
      return JointKind::kRotary;
    case urdf::Joint::PRISMATIC:
      return JointKind::kPrismatic;
    default:
      throw UrdfError(
          fmt::format("has a joint \"{}\" that is not revolute, continuous, prismatic or fixed", joint.name));
  }
}

UrdfJoint limits_of(const urdf::Joint& joint) {
  UrdfJoint limits{joint.name};
  if (joint.limits == nullptr || joint.type == urdf::Joint::CONTINUOUS) return limits;
  limits.lower_q = joint.limits->lower;
  limits.upper_q = joint.limits->upper;
  if (limits.lower_q > limits.upper_q) {
    throw UrdfError(fmt::format("has a joint \"{}\" whose lower limit is above its upper one", joint.name));
  }
  limits.is_bounded = limits.lower_q < limits.upper_q;
  return limits;
}

}  // namespace

UrdfChain read_urdf_chain(const std::string& xml, const std::string& base_link, const std::string& tip_link) {
  const urdf::ModelInterfaceSharedPtr model = parse(xml);
  UrdfChain found;
  JointChain& chain = found.chain;
  Pose at;  // of the present link, in frame 0, with all joints at zero
  for (const urdf::JointSharedPtr& joint : joints_between(*model, base_link, tip_link)) {
    at = at * pose_of(joint->parent_to_joint_origin_transform);
    if (!is_near(at)) {
      throw UrdfError(fmt::format("has the origin of joint \"{}\" further than {:g} m from link \"{}\"",
                                  joint->name, kFarthestOrigin_m, base_link));
    }
    if (joint->type == urdf::Joint::FIXED) continue;
    const JointKind kind = kind_of(*joint);
    if (joint->mimic != nullptr) {
      throw UrdfError(
          fmt::format("has a joint \"{}\" that follows \"{}\" (mimic); every joint of an arm moves by itself",
                      joint->name, joint->mimic->joint_name));
    }
    const Vector3 axis{joint->axis.x, joint->axis.y, joint->axis.z};
    const double length = norm(axis);
    if (!(length > 1e-6) || !std::isfinite(length)) {
      throw UrdfError(fmt::format("has a joint \"{}\" without an axis", joint->name));
    }
    if (chain.count == kMaxJoints) {
      throw UrdfError(fmt::format("has more than {} joints between these links: the seventh is \"{}\"",
                                  kMaxJoints, joint->name));
    }
    chain.axes[chain.count] = {kind, rotate(at.orientation, (1.0 / length) * axis), at.position_m};
    found.joints[chain.count] = limits_of(*joint);
    ++chain.count;
  }
  if (chain.count == 0) throw UrdfError("has no joint that moves between base and tip link");
  chain.zero_T_n = at;
  return found;
}

}  // namespace corbot::config
