// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "cell/camera/detector.h"

// Camera pictures for people.

namespace corbot::cell {

/// The largest JPEG file: the bound of `Jpeg` in idl/cell.idl.
inline constexpr std::size_t kMostJpegBytes = 1'048'576;

/// Draws the found pieces into a picture of the camera's size: the outline of each label, the kind, and the
/// position in millimetres. A pixel has three bytes: blue, green, red.
void mark(std::span<std::uint8_t> bgr, const CellConfig& cell, const std::vector<Detection>& found);

/// Returns the picture as a JPEG file of at most kMostJpegBytes; a large file gets a lower quality. Throws
/// std::runtime_error if libjpeg-turbo fails, or if no quality gives a small enough file.
[[nodiscard]] std::vector<std::uint8_t> to_jpeg(std::span<const std::uint8_t> bgr,
                                                std::array<int, 2> size_px);

}  // namespace corbot::cell
