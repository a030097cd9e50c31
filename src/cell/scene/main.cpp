// SPDX-License-Identifier: Apache-2.0
// corbot-scene simulates the world of a cell.
#include "cell/scene/scene_program.h"
#include "corbot/standard_streams.h"

int main(int argc, char** argv) { return corbot::cell::scene_main(argc, argv); }
