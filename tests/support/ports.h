// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::test {

/// Returns a free TCP port, which is this program's own until it ends. No other test program gets it. No
/// connection takes it by chance, because it lies below those that the kernel hands out. Throws
/// std::runtime_error when there is none.
int free_port();
/// The first of `count` such ports in a row.
int free_ports(int count);

}  // namespace corbot::test
