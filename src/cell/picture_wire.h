// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot::cell {

/// The header of a picture on the scene's Unix socket, which works like a triggered machine-vision camera.
/// The client writes one byte. The scene replies with this header and `rows` rows of `columns` pixels. A
/// pixel has three bytes: blue, green, red. Both ends are on one machine. The reader checks every field.
struct PictureHeader {
  static constexpr std::uint32_t kMagic = 0x31706263;  // "cbp1"
  std::uint32_t magic{kMagic};
  std::uint32_t columns{};
  std::uint32_t rows{};
  std::uint32_t reserved{};
  std::uint64_t number{};  ///< rises with each picture
  double exposure_s{};     ///< middle of the exposure, Unix epoch
};
static_assert(sizeof(PictureHeader) == 32);

}  // namespace corbot::cell
