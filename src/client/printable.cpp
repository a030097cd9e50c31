// SPDX-License-Identifier: Apache-2.0
#include "client/printable.h"

#include <cstddef>

namespace corbot::client {

std::string printable(std::string_view text) {
  constexpr std::size_t kMost = 400;
  std::string out(text.substr(0, kMost));
  for (char& c : out) {
    if (c < 0x20 || c > 0x7e) c = '?';
  }
  return out;
}

}  // namespace corbot::client
