// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <optional>
#include <string>

#include "corbot/channel/servant_mailbox.h"
#include "rt/cycle/cycle.h"
#include "shm/channel_server.h"
#include "shm/segment.h"

namespace corbot::rt {

/// The real-time task's side of the channel: its own segment, the stop segment, and the socket at which
/// others receive them. The own segment begins with the data of the previous task. The previous segment comes
/// from the task's supervisor, else from a servant that still lives. It counts only if the run directory
/// names it as the last one: a frozen or lying servant may offer an older segment. Set-up and tear-down only.
class TaskChannel {
 public:
  /// Throws SegmentError if another task of this robot runs. `fresh`: it takes nothing over, and throws
  /// std::runtime_error if a servant waits for this robot.
  TaskChannel(const std::string& robot, std::uint64_t fingerprint, ChannelPolicy policy, bool fresh,
              const std::atomic<bool>& cancelled);
  TaskChannel(const TaskChannel&) = delete;
  TaskChannel& operator=(const TaskChannel&) = delete;
  ~TaskChannel() = default;

  [[nodiscard]] TaskSegment& task() noexcept { return *task_; }
  [[nodiscard]] CycleChannel cycle_channel() noexcept { return {*task_, stop_->count, mailbox_}; }
  [[nodiscard]] const ChannelServer& server() const noexcept { return server_; }

 private:
  void take_over(const TaskSegment& before) noexcept;
  void refuse(const TaskSegment& before) noexcept;
  [[nodiscard]] bool keep(std::size_t name, bool is_name_taken);

  Segment<TaskSegment> task_;
  Segment<StopSegment> stop_;
  ServantMailbox mailbox_;
  bool is_last_{false};   ///< the run directory names this task as the last one
  ChannelServer server_;  // its thread uses all members above
};

}  // namespace corbot::rt
