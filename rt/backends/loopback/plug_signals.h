// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::rt {

/// A device with a plug that a signal handler can pull.
class Pluggable {
 public:
  virtual void set_plugged(bool plugged) noexcept = 0;

 protected:
  ~Pluggable() = default;
};

/// While it exists, SIGUSR1 to the process pulls the plug of a simulated device and SIGUSR2 puts it back.
/// Afterwards both signals are ignored. A process may have one at a time.
class PlugSignals {
 public:
  static constexpr const char* kHelp =
      "The loopback backend's device can be lost and found on purpose: SIGUSR1 pulls its plug, "
      "SIGUSR2 puts it back.";

  explicit PlugSignals(Pluggable& device) noexcept;
  PlugSignals(const PlugSignals&) = delete;
  PlugSignals& operator=(const PlugSignals&) = delete;
  ~PlugSignals();
};

}  // namespace corbot::rt
