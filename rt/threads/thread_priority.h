// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::rt {

/// Set-up only. SCHED_FIFO at `priority`, 1 to 99, for the calling thread. 0, or errno.
[[nodiscard]] int set_fifo_priority(int priority) noexcept;

/// Set-up only. Binds the calling thread to a CPU. 0, or errno; EINVAL for a CPU that there cannot be.
[[nodiscard]] int bind_to_cpu(int cpu) noexcept;

}  // namespace corbot::rt
