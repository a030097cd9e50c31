// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::test {

/// A reference to an object at one address over IIOP 1.2, taken apart: what a client may do with one that it
/// was given.
struct Ior {
  std::string type;  ///< repository id
  std::string host;
  int port{};
  std::string key;
};

/// Reads the first IIOP profile; throws std::invalid_argument when there is none.
Ior parse_ior(const std::string& text);
std::string to_string(const Ior& ior);

}  // namespace corbot::test
