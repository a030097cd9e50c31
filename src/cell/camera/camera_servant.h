// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "cell.hh"
#include "cell/camera/detector.h"
#include "cell/camera/scene_source.h"

namespace corbot::cell {

/// Implements the object Camera of a cell. Several threads may call it; a mutex serialises the pictures.
class CameraServant : public POA_Corbot::Camera {
 public:
  /// `cell` must outlive the servant. Throws ConfigError if the picture does not show every place whole.
  explicit CameraServant(const CellConfig& cell);

  Corbot::Frame* Look(CORBA::Double timeout) override;
  Corbot::Jpeg* Picture(CORBA::Boolean marked) override;

 private:
  /// A picture and the pieces that the detector found in it.
  struct Examined {
    std::vector<std::uint8_t> bgr;
    std::vector<Detection> found;
  };

  const CellConfig& cell_;
  Detector detector_;
  std::timed_mutex mutex_;  ///< guards source_ and number_
  SceneSource source_;
  std::uint64_t number_{0};

  std::mutex last_mutex_;  ///< guards last_ alone, so Picture does not wait for a long Look
  std::shared_ptr<const Examined> last_;
};

}  // namespace corbot::cell
