// SPDX-License-Identifier: Apache-2.0
#include "cell/camera/camera_servant.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "cell/camera/picture_view.h"
#include "corbot/units.h"

namespace corbot::cell {
namespace {

constexpr std::size_t kMostSightings = 256;  // of idl/cell.idl

void fill(Corbot::Sightings& sightings, const std::vector<Detection>& found) {
  sightings.length(static_cast<CORBA::ULong>(std::min(found.size(), kMostSightings)));
  for (CORBA::ULong i = 0; i < sightings.length(); ++i) {
    const Detection& detection = found[i];
    sightings[i].kind = detection.kind.c_str();
    sightings[i].position = {detection.position_m.x(), detection.position_m.y(), detection.position_m.z()};
    sightings[i].yaw = to_degrees(detection.yaw_rad);
    sightings[i].confidence = detection.confidence;
  }
}

}  // namespace

CameraServant::CameraServant(const CellConfig& cell)
    : cell_(cell), detector_(cell), source_(cell.picture_socket(), cell.camera.size_px) {}

Corbot::Frame* CameraServant::Look(CORBA::Double timeout) {
  const auto begin = SceneSource::Clock::now();
  if (!(timeout >= 0.1 && timeout <= 60))
    throw Corbot::BadParameter("timeout", timeout, "the time-out must be from 0.1 to 60 seconds");
  const auto deadline = begin + std::chrono::duration_cast<SceneSource::Clock::duration>(
                                    std::chrono::duration<double>(timeout));
  const std::unique_lock lock(mutex_, deadline);
  if (!lock.owns_lock()) throw Corbot::NotReady("other calls of Look took the camera for the whole time-out");
  try {
    const SourcePicture picture = source_.take(deadline);
    Corbot::Frame_var frame = new Corbot::Frame;
    frame->time = picture.exposure_s;
    const auto examined = std::make_shared<const Examined>(
        Examined{{picture.bgr.begin(), picture.bgr.end()}, detector_.detect(picture.bgr)});
    fill(frame->pieces, examined->found);
    frame->number = ++number_;
    const std::lock_guard last_lock(last_mutex_);
    last_ = examined;
    return frame._retn();
  } catch (const SourceError& error) {
    spdlog::warn("{}", error.what());
    throw Corbot::NotReady(error.what());
  }
}

Corbot::Jpeg* CameraServant::Picture(CORBA::Boolean marked) {
  std::shared_ptr<const Examined> last;
  {
    const std::lock_guard lock(last_mutex_);
    last = last_;
  }
  if (!last) throw Corbot::NotReady("no picture has been examined yet: call Look first");
  try {
    std::vector<std::uint8_t> bgr = last->bgr;
    if (marked) mark(bgr, cell_, last->found);
    const std::vector<std::uint8_t> bytes = to_jpeg(bgr, cell_.camera.size_px);
    Corbot::Jpeg_var jpeg = new Corbot::Jpeg;
    jpeg->length(static_cast<CORBA::ULong>(bytes.size()));
    std::copy(bytes.begin(), bytes.end(), jpeg->get_buffer());
    return jpeg._retn();
  } catch (const std::runtime_error& error) {
    spdlog::warn("{}", error.what());
    throw Corbot::NotReady(error.what());
  }
}

}  // namespace corbot::cell
