// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::cli {

/// Returns the text of `help` in `corbot calibrate`.
[[nodiscard]] const char* calibrate_help();

}  // namespace corbot::cli
