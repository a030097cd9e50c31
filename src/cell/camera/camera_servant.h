// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <mutex>

#include "cell.hh"
#include "cell/camera/detector.h"
#include "cell/camera/scene_source.h"

namespace corbot::cell {

/// The object Camera of a cell. Calls come from several threads; they take their pictures one after another.
class CameraServant : public POA_Corbot::Camera {
 public:
  /// Throws ConfigError where the picture does not show a whole place.
  explicit CameraServant(const CellConfig& cell);

  Corbot::Frame* Look(CORBA::Double timeout) override;

 private:
  Detector detector_;
  std::timed_mutex mutex_;  ///< guards what follows
  SceneSource source_;
  std::uint64_t number_{0};
};

}  // namespace corbot::cell
