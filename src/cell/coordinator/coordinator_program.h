// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cell/coordinator/coordinator_servant.h"

namespace corbot::cell {

/// Implements main() of corbot-coordinator. Test programs inject faults into the work by `wrap_ports`.
[[nodiscard]] int coordinator_main(int argc, char** argv, const WrapPorts& wrap_ports = {});

}  // namespace corbot::cell
