// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdlib>
#include <iostream>

namespace corbot::test {

/// CORBOT_SEED from the environment, or a fixed one; printed.
inline std::uint64_t seed() {
  const char* text = std::getenv("CORBOT_SEED");
  const std::uint64_t value = text != nullptr ? std::strtoull(text, nullptr, 0) : 1751;
  std::cout << "seed " << value << "\n";
  return value;
}

/// CORBOT_CASES from the environment, or as many as a quick run takes.
inline int cases(int usual) {
  const char* text = std::getenv("CORBOT_CASES");
  return text != nullptr ? std::atoi(text) : usual;
}

}  // namespace corbot::test
