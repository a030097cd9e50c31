// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

enum class Level { kOk, kWarn, kFail };

/// One line of `corbot doctor`.
struct Finding {
  Level level{};
  std::string subject;
  std::string text;  ///< the finding
  std::string fix;   ///< the remedy; empty when ok
};

}  // namespace corbot::cli
