// SPDX-License-Identifier: Apache-2.0
#include "interop/answers.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace corbot::test {
namespace {

bool opens(const std::string& token) { return token == "{" || token == "["; }
bool closes(const std::string& token) { return token == "}" || token == "]"; }

/// The end of the value that begins at `at`: a token, or all up to the bracket's end.
std::size_t end_of_value(const std::vector<std::string>& all, std::size_t at) {
  int depth = 0;
  for (; at < all.size(); ++at) {
    if (opens(all[at])) ++depth;
    if (closes(all[at])) --depth;
    if (depth == 0) return at + 1;
  }
  return at;
}

std::optional<double> number(const std::string& token) {
  std::size_t used = 0;
  try {
    const double value = std::stod(token, &used);
    if (used == token.size()) return value;
  } catch (const std::exception&) {
    return std::nullopt;
  }
  return std::nullopt;
}

bool equal(const std::string& expected, const std::string& token) {
  const auto a = number(expected);
  const auto b = number(token);
  if (a && b) {
    if (std::isnan(*a) || std::isinf(*a)) return std::isnan(*a) ? std::isnan(*b) : *a == *b;
    return std::abs(*a - *b) <= 1e-6 * std::max(1.0, std::abs(*a));
  }
  return ::fnmatch(expected.c_str(), token.c_str(), 0) == 0;
}

}  // namespace

std::vector<std::string> tokens(const std::string& answer) {
  std::vector<std::string> found;
  for (std::size_t i = 0; i < answer.size();) {
    const char c = answer[i];
    std::size_t end = i + 1;
    if (c == '"') {
      while (end < answer.size() && answer[end] != '"') end += answer[end] == '\\' ? 2 : 1;
      ++end;
    } else if (std::string("{}[]= ").find(c) == std::string::npos) {
      end = std::min(answer.find_first_of("{}[]= ", i), answer.size());
    }
    if (c != ' ') found.push_back(answer.substr(i, end - i));
    i = end;
  }
  return found;
}

bool matches(const std::string& expected, const std::string& answer) {
  const auto want = tokens(expected);
  const auto have = tokens(answer);
  std::size_t at = 0;
  for (const std::string& token : want) {
    if (at >= have.size()) return false;
    if (token == "*") {
      if (closes(have[at])) return false;
      at = end_of_value(have, at);
    } else if (equal(token, have[at])) {
      ++at;
    } else {
      return false;
    }
  }
  return at == have.size();
}

}  // namespace corbot::test
