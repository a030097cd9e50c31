// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "orb/omniorb/place.h"
#include "robot/corbot_robot.h"

namespace corbot::omni {

/// The client of the present thread's call, for corbot_robot.h, during the lifetime of this object.
class Caller {
 public:
  /// `key`: key of the called reference; "": the public one. `place`: slot of the call, if it has one; it
  /// must outlive this.
  explicit Caller(std::string key, const Place* place = nullptr);
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;
  ~Caller() = default;

  [[nodiscard]] const corbot_caller* get() const noexcept { return &caller_; }
  /// Plans motions into `plan`, which must outlive this, and does not start them.
  void plan_only(corbot_plan& plan) noexcept { caller_.plan = &plan; }
  [[nodiscard]] bool is_public() const noexcept { return key_.empty(); }

 private:
  const std::string key_;
  char from_[CORBOT_PEER_TEXT];
  corbot_caller caller_{};
};

}  // namespace corbot::omni
