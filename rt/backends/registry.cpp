// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/registry.h"

#include <fmt/format.h>

#include <array>
#include <stdexcept>
#include <string_view>

#include "rt/backends/bus_backend.h"
#include "rt/backends/maestro.h"
#include "rt/backends/mini_ssc.h"
#include "rt/backends/ssc32.h"
#include "sim/loopback_backend.h"

namespace corbot::rt {
namespace {

using Maker = std::unique_ptr<Backend> (*)(const Profile&, EmergencyStop&);

std::unique_ptr<Backend> make_loopback(const Profile& profile, EmergencyStop&) {
  const LoopbackOptions& options = profile.backend.loopback;
  sim::LoopbackSettings settings;
  settings.frame_hz = options.frame_hz;
  settings.readback = options.readback;
  settings.servo.rate_us_per_s = options.rate_us_per_s;
  settings.servo.dead_band_us = options.dead_band_us;
  settings.servo.lag_s = options.lag_s;
  return std::make_unique<sim::LoopbackBackend>(profile.arm, settings);
}

std::unique_ptr<Backend> on_bus(const Profile& profile, std::unique_ptr<BusDevice> device,
                                EmergencyStop& stop) {
  BusSettings settings;
  settings.name = profile.backend.kind;
  settings.readback = profile.backend.serial.readback;
  settings.priority = std::max(profile.priority - 1, 1);  // below the cycle, above all that is ordinary
  settings.relax_at_end = profile.backend.serial.relax_at_end;
  return std::make_unique<BusBackend>(profile.arm, std::move(device), settings, stop);
}

/// The servos that a frame has: one a joint, and the gripper's.
std::size_t servos_of(const Profile& profile) { return profile.arm.dof + 1; }

std::unique_ptr<Backend> make_ssc32(const Profile& profile, EmergencyStop& stop) {
  const SerialOptions& options = profile.backend.serial;
  return on_bus(profile,
                std::make_unique<Ssc32>(
                    Ssc32Settings{options.port, options.baud, options.readback, servos_of(profile)}),
                stop);
}

std::unique_ptr<Backend> make_maestro(const Profile& profile, EmergencyStop& stop) {
  const SerialOptions& options = profile.backend.serial;
  return on_bus(profile,
                std::make_unique<Maestro>(MaestroSettings{options.port, options.baud, options.device_number,
                                                          options.crc, options.readback, servos_of(profile)}),
                stop);
}

std::unique_ptr<Backend> make_mini_ssc(const Profile& profile, EmergencyStop& stop) {
  const SerialOptions& options = profile.backend.serial;
  return on_bus(profile,
                std::make_unique<MiniSsc>(MiniSscSettings{options.port, options.baud, options.first_us,
                                                          options.last_us, servos_of(profile)}),
                stop);
}

/// One line a backend; its name is what `kind` in [backend] says.
constexpr std::array<std::pair<std::string_view, Maker>, 4> kBackends{{{"loopback", make_loopback},
                                                                       {"maestro", make_maestro},
                                                                       {"minissc", make_mini_ssc},
                                                                       {"ssc32", make_ssc32}}};

}  // namespace

std::unique_ptr<Backend> make_backend(const Profile& profile, EmergencyStop& stop) {
  std::string known;
  for (const auto& [name, make] : kBackends) {
    if (name == profile.backend.kind) return make(profile, stop);
    known += fmt::format("{}\"{}\"", known.empty() ? "" : ", ", name);
  }
  throw std::runtime_error(fmt::format("{}: there is no backend \"{}\"; this build knows {}", profile.file,
                                       profile.backend.kind, known));
}

}  // namespace corbot::rt
