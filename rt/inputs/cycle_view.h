// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace corbot::rt {

/// What the cycle has published last; before its first step, what the one of the task before has. And how far the thread
/// that serves the device has come.
struct CycleView {
  std::uint64_t cycle{};
  bool in_error{};            ///< or nothing has been published yet, or could be read
  bool power_off{};           ///< kSnapshotPowerOff
  bool fault_stop{};          ///< kSnapshotFaultStop
  bool is_known{true};        ///< false: only in_error and bus_beats are valid
  std::uint32_t bus_beats{};  ///< Backend::beats(); 0: the device has no thread
};

}  // namespace corbot::rt
