// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>

#include "support/paths.h"

namespace corbot::test {

/// CORBOT_SEED from the environment, or a fixed one; printed.
inline std::uint64_t seed() {
  const char* text = std::getenv("CORBOT_SEED");
  const std::uint64_t value = text != nullptr ? std::strtoull(text, nullptr, 0) : 1751;
  std::cout << "seed " << value << "\n";
  return value;
}

/// CORBOT_CASES from the environment, or as many as a quick run takes. The sanitizers look for faults of
/// memory, which a sixteenth of the cases shows, too.
inline int cases(int usual) {
  const char* text = std::getenv("CORBOT_CASES");
  return text != nullptr ? std::atoi(text) : CORBOT_SANITIZED ? usual / 16 : usual;
}

}  // namespace corbot::test
