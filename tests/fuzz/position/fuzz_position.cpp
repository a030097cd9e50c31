// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "config/load_profile.h"
#include "state/last_position.h"
#include "support/paths.h"

namespace {

const corbot::ArmModel& arm() {
  static const corbot::ArmModel model =
      corbot::load_profile(std::filesystem::path(CORBOT_PROFILES) / "lynx5.toml").arm;
  return model;
}

/// Returns true if the position keeps all that an accepted one must keep, whatever its text was.
bool is_sound(const corbot::LastPosition& position) {
  for (std::size_t i = 0; i < corbot::kMaxJoints; ++i) {
    const double angle = position.position_q[i];
    if (!(angle >= arm().joints[i].lower_q && angle <= arm().joints[i].upper_q)) return false;
  }
  return position.opening >= 0.0 && position.opening <= 1.0;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string text;
  for (const char c : std::string_view(reinterpret_cast<const char*>(data), size)) {
    // A fingerprint is nothing that a fuzzer finds.
    text += c == '@' ? fmt::format("{:016x}", corbot::position_fingerprint(arm())) : std::string(1, c);
  }
  try {
    const corbot::LastPosition position = corbot::parse_position(text, "lynx5", "ssc32", arm());
    if (!is_sound(position)) std::abort();
    // The text written for an accepted position is accepted again.
    if (!is_sound(corbot::parse_position(corbot::position_text(position, arm()), "lynx5", "ssc32", arm())))
      std::abort();
  } catch (const corbot::PositionError& error) {
    if (*error.what() == '\0') std::abort();
  }
  return 0;
}
