// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::rt {

/// Set-up only. Sets SCHED_FIFO at `priority`, 1 to 99, for the calling thread. Returns 0, or errno.
[[nodiscard]] int set_fifo_priority(int priority) noexcept;

/// Set-up only. Binds the calling thread to a CPU. Returns 0, or errno; EINVAL for an impossible CPU.
[[nodiscard]] int bind_to_cpu(int cpu) noexcept;

}  // namespace corbot::rt
