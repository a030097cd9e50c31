// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot::rt {

/// The cycle's last published state; before the first step, that of the previous task. It also has the
/// progress of the thread that serves the device.
struct CycleView {
  std::uint64_t cycle{};
  bool in_error{};            ///< in Error, or nothing has been published yet, or could be read
  bool power_off{};           ///< kSnapshotPowerOff
  bool fault_stop{};          ///< kSnapshotFaultStop
  bool is_known{true};        ///< false: only in_error and bus_beats are valid
  std::uint32_t bus_beats{};  ///< Backend::beats(); 0: the device has no thread
};

}  // namespace corbot::rt
