// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>

#include "support/paths.h"

namespace corbot::test {

/// CORBOT_SEED from the environment, or `otherwise`; printed, so that a failure can be repeated.
inline std::uint64_t seed(std::uint64_t otherwise = 1751) {
  const char* text = std::getenv("CORBOT_SEED");
  const std::uint64_t value = text != nullptr ? std::strtoull(text, nullptr, 0) : otherwise;
  std::cout << "CORBOT_SEED=" << value << std::endl;
  return value;
}

/// CORBOT_SEED, or another seed in each run.
inline std::uint64_t drawn_seed() { return seed(std::random_device{}()); }

/// The number of random cases, or of rounds of a race: CORBOT_CASES from the environment, or `usual` with
/// CORBOT_USUAL_CASES, as at night. The gate runs a quarter. The sanitizers look for faults of memory and for
/// data races, which a sixteenth shows, too.
inline int cases(int usual) {
  if (const char* text = std::getenv("CORBOT_CASES")) return std::atoi(text);
  if (CORBOT_SANITIZED) return usual / 16;
  return std::getenv("CORBOT_USUAL_CASES") != nullptr ? usual : usual / 4;
}

}  // namespace corbot::test
