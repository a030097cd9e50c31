// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "corbot/kinematics/pose.h"
#include "robot/kept_setting.h"
#include "state/further_shapes_store.h"

namespace corbot {

/// Planes and boxes beside the profile's. They stand in the world and hold for the base frame for which they
/// were set. With another base frame no joint moves, since they would stand elsewhere around the arm.
/// Thread-safe.
class FurtherWorkspace : public KeptSetting<FurtherShapesStore> {
 public:
  using KeptSetting::KeptSetting;

  /// Returns true if they are known and hold for this base frame. Without planes and boxes every base does.
  [[nodiscard]] bool is_known_at(const Pose& world_T_base) const;
  /// Returns nothing if none are set, or they are not known.
  [[nodiscard]] std::optional<FurtherShapes> shapes() const;
  /// Throws CallError (not ready) if the request moves joints, and is_known_at() is false.
  void check_known_at(const MotionRequest& request, const Pose& world_T_base) const;
};

}  // namespace corbot
