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

/// The object Camera of a cell. Calls come from several threads; they take their pictures one after another.
class CameraServant : public POA_Corbot::Camera {
 public:
  /// `cell` must outlive it. Throws ConfigError where the picture does not show a whole place.
  explicit CameraServant(const CellConfig& cell);

  Corbot::Frame* Look(CORBA::Double timeout) override;
  Corbot::Jpeg* Picture(CORBA::Boolean marked) override;

 private:
  /// A picture that was examined, and what was found in it.
  struct Examined {
    std::vector<std::uint8_t> bgr;
    std::vector<Detection> found;
  };

  const CellConfig& cell_;
  Detector detector_;
  std::timed_mutex mutex_;  ///< guards what follows
  SceneSource source_;
  std::uint64_t number_{0};

  std::mutex last_mutex_;  ///< guards what follows; a look may take long, and a picture does not wait for it
  std::shared_ptr<const Examined> last_;
};

}  // namespace corbot::cell
