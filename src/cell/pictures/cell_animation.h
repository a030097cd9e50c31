// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "cell/cell_config.h"
#include "cell/scene_record.h"

namespace corbot::cell {

/// The size that the animation should not exceed. cell_animation() coarsens the motions for it, up to
/// `kCoarsest`.
inline constexpr std::size_t kAnimation_bytes = 290'000;

/// Returns an SVG of the cell from above in which arms and pieces move as in the record. The SVG has no
/// script, repeats forever, and follows the viewer's light or dark scheme.
[[nodiscard]] std::string cell_animation(const CellConfig& cell, const SceneRecord& record);

}  // namespace corbot::cell
