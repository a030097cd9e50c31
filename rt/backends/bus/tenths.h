// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdlib>
#include <string>

namespace corbot::rt {

/// Returns the value as "30.2" or "-0.5".
inline std::string tenths(double value) {
  const long long tenths = std::llround(value * 10.0);
  const long long size = std::llabs(tenths);
  return (tenths < 0 ? "-" : "") + std::to_string(size / 10) + "." + std::to_string(size % 10);
}

}  // namespace corbot::rt
