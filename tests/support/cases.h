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

/// The number of random cases, or of rounds of a race: CORBOT_CASES from the environment, or `usual` with
/// CORBOT_USUAL_CASES, as at night. The gate runs a quarter. The sanitizers look for faults of memory and for
/// data races, which a sixteenth shows, too.
inline int cases(int usual) {
  if (const char* text = std::getenv("CORBOT_CASES")) return std::atoi(text);
  if (CORBOT_SANITIZED) return usual / 16;
  return std::getenv("CORBOT_USUAL_CASES") != nullptr ? usual : usual / 4;
}

}  // namespace corbot::test
