// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::test {

/// From here on every system call of this thread that is not a sleep, or part of the thread's end, is noted
/// and refused. False where the kernel or a sanitizer does not allow that; nothing is watched then.
bool watch_system_calls();

/// Number of the first system call that a watched thread made; −1: none.
int first_system_call();

}  // namespace corbot::test
