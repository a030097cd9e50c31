// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::cli {

/// The text of `help` in `corbot calibrate`.
[[nodiscard]] const char* calibrate_help();

}  // namespace corbot::cli
