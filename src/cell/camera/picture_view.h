// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cell/camera/detector.h"

// A picture of the camera as people look at it.

namespace corbot::cell {

/// The most bytes of a picture: of `Jpeg` in idl/cell.idl.
inline constexpr std::size_t kMostJpegBytes = 1'048'576;

/// Draws into a picture, whose size is the camera's, what was found in it: the outline of each piece's label,
/// its kind, and its position in millimetres. Rows of pixels, three bytes each: blue, green, red.
void mark(std::span<std::uint8_t> bgr, const CellConfig& cell, const std::vector<Detection>& found);

/// The picture as a JPEG file of at most kMostJpegBytes; one of many details has a lower quality. Throws
/// std::runtime_error where libjpeg-turbo refuses, or where no quality is low enough.
[[nodiscard]] std::vector<std::uint8_t> to_jpeg(std::span<const std::uint8_t> bgr,
                                                std::array<int, 2> size_px);

}  // namespace corbot::cell
