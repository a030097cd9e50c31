// SPDX-License-Identifier: Apache-2.0
// Fuzzes the frames that drives and interfaces may send: SDO answers, process data, emergencies, heartbeats,
// error frames. The input is a row of frames, eleven bytes each: two of identifier, one of kind and length,
// eight of data.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "rt/backends/can/canopen_sdo.h"
#include "rt/backends/can/cia402.h"
#include "rt/backends/can/drive_watch.h"

namespace {

using namespace corbot::rt;
using Step = SdoTransfer::Step;

constexpr std::size_t kFrameBytes = 11;
constexpr std::uint8_t kNode = 1;

CanFrame frame_of(const std::uint8_t* bytes) {
  CanFrame frame{};
  frame.can_id = (bytes[0] | static_cast<canid_t>(bytes[1]) << 8) & CAN_SFF_MASK;
  if ((bytes[2] & 0x80) != 0) frame.can_id |= CAN_ERR_FLAG;
  if ((bytes[2] & 0x40) != 0) frame.can_id |= CAN_EFF_FLAG;
  if ((bytes[2] & 0x20) != 0) frame.can_id |= CAN_RTR_FLAG;
  frame.can_dlc = bytes[2] & 0x0F;  // also more than there can be
  for (std::size_t i = 0; i < CAN_MAX_DLEN; ++i) frame.data[i] = bytes[3 + i];
  return frame;
}

bool has_ended(SdoTransfer& transfer, const CanFrame& frame) {
  const Step step = transfer.take(frame);
  if (transfer.data().size() > SdoTransfer::kMostBytes) std::abort();
  if (step == Step::kAborted && describe_abort(transfer.abort_code()).empty()) std::abort();
  if (step != Step::kIgnored &&
      (transfer.request().can_id != kSdoRequest + kNode || transfer.request().can_dlc != 8)) {
    std::abort();
  }
  return step != Step::kIgnored && step != Step::kSend;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  DriveWatch watch({kNode, 2, 127});
  DriveWatch::Time now{std::chrono::seconds(1000)};
  watch.clear(now);
  SdoTransfer upload = SdoTransfer::upload(kNode, {0x1008});
  SdoTransfer download = SdoTransfer::download(kNode, {0x6060}, 8, 1);
  for (; size >= kFrameBytes; data += kFrameBytes, size -= kFrameBytes) {
    const CanFrame frame = frame_of(data);
    now += std::chrono::milliseconds(data[2]);
    watch.take(frame, now);
    try {
      watch.check(now, std::chrono::milliseconds(600), std::chrono::seconds(1));
      for (const DriveReport& drive : watch.drives()) {
        const bool works =
            !drive.has_process || state_of(drive.process.statusword) == DriveState::kOperationEnabled;
        if (!works || is_fault(drive.emergency)) std::abort();
      }
    } catch (const DeviceError& error) {
      if (error.cause() == corbot::DeviceCause::kNone || *error.what() == '\0') std::abort();
    }
    if (const auto warning = watch.warning(now, std::chrono::milliseconds(50));
        warning && *warning->what() == '\0') {
      std::abort();
    }
    if (frame.can_dlc > CAN_MAX_DLEN) continue;  // CanPort lets none through
    if (has_ended(upload, frame)) upload = SdoTransfer::upload(kNode, {0x1008});
    if (has_ended(download, frame)) download = SdoTransfer::download(kNode, {0x6060}, 8, 1);
  }
  return 0;
}
