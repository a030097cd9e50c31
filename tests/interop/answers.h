// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace corbot::test {

/// A test client's answer, cut into brackets, '=', texts in quotes, and words.
std::vector<std::string> tokens(const std::string& answer);

/// Whether the answer is the expected one: numbers to 1e-6 (of 1, or of their size), `*` for any value, a
/// text ending in `*` for any that begins so.
bool matches(const std::string& expected, const std::string& answer);

}  // namespace corbot::test
