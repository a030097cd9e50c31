// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "cell/cell_config.h"
#include "cell/scene_record.h"

namespace corbot::cell {

/// The animation is drawn more coarsely until it is below this, as far as `kCoarsest`.
inline constexpr std::size_t kAnimation_bytes = 290'000;

/// An SVG of the cell from above in which arms and pieces move as in the record. It has no script, repeats
/// for ever, and follows the viewer's light or dark scheme.
[[nodiscard]] std::string cell_animation(const CellConfig& cell, const SceneRecord& record);

}  // namespace corbot::cell
