// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "soak/stage.h"

namespace corbot::soak {

/// Breaks emulated devices of this kind (gpio, ssc32, maestro, cia402), their wires and the robot's processes
/// at random, and judges what the devices saw. The exit code.
int run_devices(int faults, std::uint64_t seed, bool verbose, const std::string& only,
                const StageOptions& options);
/// A quarter of the faults on each kind, two kinds at a time, each by this program of its own. The exit code.
int run_all_devices(int faults, std::uint64_t seed, bool verbose, const std::string& program,
                    const std::string& orb);

}  // namespace corbot::soak
