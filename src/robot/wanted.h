// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace corbot {

/// Abort check of a waiting call, polled every few milliseconds. Throws CallError to abort the call. Empty:
/// no limit.
using Wanted = std::function<void()>;

inline void check(const Wanted& wanted) {
  if (wanted) wanted();
}

}  // namespace corbot
