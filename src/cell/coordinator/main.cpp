// SPDX-License-Identifier: Apache-2.0
// corbot-coordinator drives the robots of a cell from Coordinator.Start until a signal ends the program.
#include "cell/coordinator/coordinator_program.h"
#include "corbot/standard_streams.h"

int main(int argc, char** argv) { return corbot::cell::coordinator_main(argc, argv); }
