// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace corbot {

/// Called at each look of a call that waits, every few milliseconds: throws CallError where it is to wait no longer. Empty:
/// it waits for as long as it takes.
using Wanted = std::function<void()>;

inline void check(const Wanted& wanted) {
  if (wanted) wanted();
}

}  // namespace corbot
