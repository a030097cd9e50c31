// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/registry.h"

#include <fmt/format.h>

#include <array>
#include <stdexcept>
#include <string_view>

#include "sim/loopback_backend.h"

namespace corbot::rt {
namespace {

using Maker = std::unique_ptr<Backend> (*)(const Profile&);

std::unique_ptr<Backend> make_loopback(const Profile& profile) {
  const LoopbackOptions& options = profile.backend.loopback;
  sim::LoopbackSettings settings;
  settings.frame_hz = options.frame_hz;
  settings.readback = options.readback;
  settings.servo.rate_us_per_s = options.rate_us_per_s;
  settings.servo.dead_band_us = options.dead_band_us;
  settings.servo.lag_s = options.lag_s;
  return std::make_unique<sim::LoopbackBackend>(profile.arm, settings);
}

/// One line a backend; its name is what `kind` in [backend] says.
constexpr std::array<std::pair<std::string_view, Maker>, 1> kBackends{{{"loopback", make_loopback}}};

}  // namespace

std::unique_ptr<Backend> make_backend(const Profile& profile) {
  std::string known;
  for (const auto& [name, make] : kBackends) {
    if (name == profile.backend.kind) return make(profile);
    known += fmt::format("{}\"{}\"", known.empty() ? "" : ", ", name);
  }
  throw std::runtime_error(fmt::format("{}: there is no backend \"{}\"; this build knows {}", profile.file,
                                       profile.backend.kind, known));
}

}  // namespace corbot::rt
