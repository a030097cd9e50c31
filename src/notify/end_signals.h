// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

// The signals that end a service: SIGINT, SIGTERM, and SIGHUP except under nohup. Not real-time safe.

namespace corbot {

/// Blocks these signals in the calling thread and in all threads that it starts later.
void block_end_signals() noexcept;

/// Prints `ready_line`, reports READY=1 and WATCHDOG=1, and returns at such a signal. All threads block these
/// signals.
void run_until_signal(const std::string& ready_line);

}  // namespace corbot
