// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::rt {

/// Of an approach, whether the device or the backend does it: a fifth of what a servo can.
inline constexpr double kApproach_us_per_s = 400.0;

}  // namespace corbot::rt
