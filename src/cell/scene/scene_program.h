// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "cell/scene/scene.h"

namespace corbot::cell {

/// Implements main() of corbot-scene. Test programs inject faults into the scene by `make_after_tick`.
[[nodiscard]] int scene_main(
    int argc, char** argv,
    const std::function<Scene::AfterTick(const CellConfig& cell)>& make_after_tick = {});

}  // namespace corbot::cell
