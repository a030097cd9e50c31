// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

enum class Level { kOk, kWarn, kFail };

/// One line of `corbot doctor`.
struct Finding {
  Level level{};
  std::string subject;
  std::string text;  ///< what was found
  std::string fix;   ///< what to do; empty when ok
};

}  // namespace corbot::cli
