// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "rt/backends/bus/approach_speed.h"
#include "rt/backends/bus/bus_backend.h"
#include "rt/backends/can/socketcan.h"
#include "rt/backends/can_settings.h"
#include "rt/backends/gpio/gpiod.h"
#include "rt/backends/loopback/loopback_backend.h"
#include "rt/backends/loopback/plug_signals.h"
#include "rt/backends/pwm/pca9685.h"
#include "rt/backends/pwm/pwm_sysfs.h"
#include "rt/backends/serial/maestro.h"
#include "rt/backends/serial/mini_ssc.h"
#include "rt/backends/serial/ssc32.h"

namespace corbot::rt {
namespace {

using Maker = std::unique_ptr<Backend> (*)(const Profile&, EmergencyStop&);

std::unique_ptr<Backend> make_loopback(const Profile& profile, EmergencyStop&) {
  const LoopbackOptions& options = profile.backend.loopback;
  LoopbackSettings settings;
  settings.frame_hz = options.frame_hz;
  settings.readback = profile.backend.common.readback;
  settings.servo.rate_us_per_s = options.rate_us_per_s;
  settings.servo.dead_band_us = options.dead_band_us;
  settings.servo.lag_s = options.lag_s;
  return std::make_unique<LoopbackBackend>(profile.arm, settings);
}

std::unique_ptr<Backend> on_bus(const Profile& profile, std::unique_ptr<BusDevice> device,
                                EmergencyStop& stop) {
  BusSettings settings;
  settings.name = profile.backend.kind;
  settings.readback = profile.backend.common.readback;
  settings.priority = std::max(profile.priority - 1, 1);  // below the cycle, above all ordinary threads
  settings.relax_at_end = profile.backend.common.relax_at_end;
  settings.stagger_ms = profile.backend.common.stagger_ms;
  settings.ramp_s = profile.stop.category == 0 ? 0.0 : profile.stop.ramp_s;
  return std::make_unique<BusBackend>(profile.arm, std::move(device), settings, stop);
}

/// Returns the number of servos in a frame: one for each joint, and the gripper's.
std::size_t servos_of(const Profile& profile) { return profile.arm.dof + 1; }

std::unique_ptr<Backend> make_ssc32(const Profile& profile, EmergencyStop& stop) {
  const SerialOptions& options = profile.backend.serial;
  return on_bus(
      profile,
      std::make_unique<Ssc32>(Ssc32Settings{options.port, options.baud, profile.backend.common.readback,
                                            servos_of(profile), options.stop_input, options.stop_at_high}),
      stop);
}

/// Returns the acceleration of an approach that all servos share: that of the slowest one.
double approach_us_per_s2(const Profile& profile) {
  double least = pulse_limits(profile.arm, profile.arm.dof).acceleration;
  for (std::size_t i = 0; i < profile.arm.dof; ++i) {
    const double own = pulse_limits(profile.arm, i).acceleration;
    if (own > 0.0) least = std::min(least, own);
  }
  return least;
}

std::unique_ptr<Backend> make_maestro(const Profile& profile, EmergencyStop& stop) {
  const SerialOptions& options = profile.backend.serial;
  MaestroSettings settings{options.port,
                           options.baud,
                           options.device_number,
                           options.crc,
                           profile.backend.common.readback,
                           servos_of(profile),
                           options.multi_target,
                           options.detect_baud};
  settings.approach_us_per_s2 = approach_us_per_s2(profile);
  return on_bus(profile, std::make_unique<Maestro>(std::move(settings)), stop);
}

std::unique_ptr<Backend> make_mini_ssc(const Profile& profile, EmergencyStop& stop) {
  const SerialOptions& options = profile.backend.serial;
  return on_bus(profile,
                std::make_unique<MiniSsc>(MiniSscSettings{options.port, options.baud, options.first_us,
                                                          options.last_us, servos_of(profile)}),
                stop);
}

std::unique_ptr<Backend> make_pca9685(const Profile& profile, EmergencyStop& stop) {
  const Pca9685Options& options = profile.backend.pca9685;
  auto chip = std::make_unique<Pca9685>(std::make_unique<I2cDev>(options.bus, options.address),
                                        Pca9685Settings{options.oscillator_hz, options.frame_hz});
  return on_bus(profile, std::move(chip), stop);
}

std::unique_ptr<Backend> make_pwm_sysfs(const Profile& profile, EmergencyStop& stop) {
  const PwmSysfsOptions& options = profile.backend.pwm_sysfs;
  PwmSysfsSettings settings;
  settings.chip = options.chip;
  settings.frame_hz = options.frame_hz;
  for (std::size_t i = 0; i < profile.arm.dof; ++i) {
    settings.channels.push_back(profile.arm.servos[i].channel);
  }
  settings.channels.push_back(profile.arm.gripper.channel);
  return on_bus(profile, std::make_unique<PwmSysfs>(std::move(settings)), stop);
}

std::unique_ptr<Backend> make_gpiod(const Profile& profile, EmergencyStop& stop) {
  const GpiodOptions& options = profile.backend.gpiod;
  GpiodSettings settings;
  settings.chip = options.chip;
  settings.lines = options.lines;
  settings.frame_hz = options.frame_hz;
  settings.order = options.staggered ? PulseOrder::kStaggered : PulseOrder::kTogether;
  settings.priority = options.priority > 0 ? options.priority : profile.priority + 1;
  settings.cpu = options.cpu;
  settings.awake_ns = std::llround(options.awake_us * 1000.0);
  return on_bus(profile, std::make_unique<Gpiod>(std::move(settings), kernel_gpio()), stop);
}

std::unique_ptr<Backend> make_socketcan(const Profile& profile, EmergencyStop& stop) {
  return on_bus(profile, std::make_unique<Cia402Drives>(cia402_settings(profile)), stop);
}

/// Lists the backends, one line each; the name is `kind` in [backend].
constexpr std::array<std::pair<std::string_view, Maker>, 8> kBackends{{{"gpiod", make_gpiod},
                                                                       {"loopback", make_loopback},
                                                                       {"maestro", make_maestro},
                                                                       {"minissc", make_mini_ssc},
                                                                       {"pca9685", make_pca9685},
                                                                       {"pwm_sysfs", make_pwm_sysfs},
                                                                       {"socketcan", make_socketcan},
                                                                       {"ssc32", make_ssc32}}};

}  // namespace

std::unique_ptr<Backend> make_backend(const Profile& profile, EmergencyStop& stop) {
  std::string known;
  for (const auto& [name, make] : kBackends) {
    if (name == profile.backend.kind) return make(profile, stop);
    known += fmt::format("{}\"{}\"", known.empty() ? "" : ", ", name);
  }
  throw std::runtime_error(fmt::format("{}: there is no backend \"{}\"; this build has {}", profile.file,
                                       profile.backend.kind, known));
}

const char* fault_controls_help() noexcept { return PlugSignals::kHelp; }

}  // namespace corbot::rt
