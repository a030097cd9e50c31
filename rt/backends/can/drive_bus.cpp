// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/drive_bus.h"

#include <algorithm>
#include <utility>

namespace corbot::rt {
namespace {

constexpr int kLatePeriods = 3;
/// The frames of this many periods may wait while no node acknowledges; later they would all go out at once.
constexpr std::size_t kQueuedPeriods = 2;

std::vector<canid_t> identifiers_of(const std::vector<DriveReport>& drives) {
  std::vector<canid_t> identifiers;
  for (const DriveReport& drive : drives) {
    for (const canid_t base : {kEmergency, kTpdo1, kSdoAnswer, kHeartbeat}) {
      identifiers.push_back(base + drive.node);
    }
  }
  return identifiers;
}

}  // namespace

DriveBus::DriveBus(std::string interface, const std::vector<std::uint8_t>& nodes, int heartbeat_ms,
                   std::int64_t period_ns)
    : interface_(std::move(interface)),
      heartbeat_(std::chrono::milliseconds(heartbeat_ms)),
      watch_(nodes),
      period_ns_(period_ns) {}

void DriveBus::open() {
  port_.open(interface_, identifiers_of(drives()));
  port_.limit_queue(kQueuedPeriods * (drives().size() + 1));
  last_listened_ = Clock::now();
  is_synchronised_ = false;
  targets_.clear();
}

void DriveBus::command(NmtCommand command) {
  for (const DriveReport& drive : drives()) {
    port_.write(nmt_frame(command, drive.node), Clock::now() + kSendWithin);
  }
}

void DriveBus::synchronise(const std::vector<std::uint16_t>& controlwords,
                           std::vector<std::int32_t> targets) {
  const auto deadline = Clock::now() + std::max<Clock::duration>(kSendWithin, period());
  for (std::size_t i = 0; i < drives().size(); ++i) {
    port_.write(rpdo_frame(drives()[i].node, controlwords[i], targets[i]), deadline);
  }
  targets_ = std::move(targets);
  request_answers(deadline);
  is_synchronised_ = true;
}

void DriveBus::request_answers(Clock::time_point deadline) {
  watch_.expect_answers(Clock::now());
  port_.write(sync_frame(), deadline);
}

void DriveBus::listen(Clock::time_point deadline, const std::function<bool()>& is_enough) {
  // After a long time without listening, as in every cycle, heartbeats may have been missed here.
  const auto begin = Clock::now();
  if (begin - last_listened_ > std::max(heartbeat_, kLatePeriods * period())) watch_.forgive(begin);
  while (!is_enough()) {
    const auto frame = port_.read(deadline);
    if (!frame) break;
    watch_.take(*frame, Clock::now());
  }
  last_listened_ = Clock::now();
  // This thread, or the machine, has stood still. The drives may have stood still, too, or their frames are
  // not here yet.
  constexpr std::chrono::milliseconds kLate{50};
  if (last_listened_ - std::max(begin, deadline) > kLate) watch_.forgive(last_listened_);
}

void DriveBus::await_answers(Clock::time_point deadline) {
  listen(deadline, [this] { return watch_.has_all_answers(); });
}

}  // namespace corbot::rt
