// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "cell/scene/scene.h"

namespace corbot::cell {

/// This is main() of corbot-scene. Programs of tests plant faults in the scene by `make_after_tick`.
[[nodiscard]] int scene_main(
    int argc, char** argv,
    const std::function<Scene::AfterTick(const CellConfig& cell)>& make_after_tick = {});

}  // namespace corbot::cell
