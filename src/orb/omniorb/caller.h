// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "orb/omniorb/place.h"
#include "robot/corbot_robot.h"

namespace corbot::omni {

/// The client of the call that the present thread carries out, as corbot_robot.h takes it, while the object lives.
class Caller {
 public:
  /// `key`: of the reference on which it called; empty: the public one. `place`: of its call, if it has one, which must
  /// outlive this.
  explicit Caller(std::string key, const Place* place = nullptr);
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;
  ~Caller() = default;

  [[nodiscard]] const corbot_caller* get() const noexcept { return &caller_; }
  /// Motions are planned into `plan`, which must outlive this, and not started.
  void plan_only(corbot_plan& plan) noexcept { caller_.plan = &plan; }
  [[nodiscard]] bool is_public() const noexcept { return key_.empty(); }

 private:
  const std::string key_;
  char from_[CORBOT_PEER_TEXT];
  corbot_caller caller_{};
};

}  // namespace corbot::omni
