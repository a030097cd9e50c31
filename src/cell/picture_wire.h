// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot::cell {

/// The scene's picture on its Unix socket, triggered like a machine-vision camera: the client writes one byte, then this header
/// comes, and `rows` rows of `columns` pixels of three bytes, blue, green, red. Both ends are on one machine. The reader trusts
/// none of it.
struct PictureHeader {
  static constexpr std::uint32_t kMagic = 0x31706263;  // "cbp1"
  std::uint32_t magic{kMagic};
  std::uint32_t columns{};
  std::uint32_t rows{};
  std::uint32_t reserved{};
  std::uint64_t number{};  ///< rises by picture
  double exposure_s{};     ///< middle of the exposure, Unix epoch
};
static_assert(sizeof(PictureHeader) == 32);

}  // namespace corbot::cell
