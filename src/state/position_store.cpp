// SPDX-License-Identifier: Apache-2.0
#include "state/position_store.h"

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "state/private_file.h"

namespace corbot {
namespace {

namespace fs = std::filesystem;

fs::path from_environment(const char* variable, const char* below) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value == '/' ? fs::path(value) / below : fs::path();
}

}  // namespace

fs::path default_state_directory() {
  for (const auto& [variable, below] :
       {std::pair{"CORBOT_STATE_DIR", ""}, {"XDG_STATE_HOME", "corbot"}, {"HOME", ".local/state/corbot"}}) {
    if (fs::path found = from_environment(variable, below); !found.empty()) return found;
  }
  return {};
}

std::string boot_id() {
  constexpr std::size_t kLength = 36;
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string text;
  return std::getline(file, text) && text.size() == kLength ? text : std::string();
}

LastPosition position_of(const Snapshot& snapshot, const std::string& robot, const std::string& device) {
  LastPosition position;
  position.robot = robot;
  position.device = device;
  position.fingerprint = snapshot.position_fingerprint;
  position.boot_id = boot_id();
  position.saved_s = static_cast<std::int64_t>(std::time(nullptr));
  position.at_rest = snapshot.command_id == 0;
  position.held = (snapshot.flags & kSnapshotHeld) != 0;
  position.in_error = snapshot.state == RtState::kError;
  position.position_q = snapshot.position_q;
  position.opening = snapshot.gripper;
  return position;
}

PositionStore::PositionStore(const fs::path& directory, const std::string& robot, const std::string& device,
                             const std::string& writer)
    : file_(directory / (state_file_stem(robot, device) + ".position")),
      fresh_(file_.string() + "." + writer),
      robot_(robot),
      device_(device) {
  if (!is_file_name(robot)) throw std::invalid_argument("'" + robot + "' is not the name of a robot");
}

std::optional<LastPosition> PositionStore::load(const ArmModel& arm) const {
  std::optional<std::string> text;
  try {
    text = read_private(file_, kMaxPositionBytes);
  } catch (const std::runtime_error& error) {
    throw PositionError(error.what());
  }
  if (!text) return std::nullopt;
  try {
    return parse_position(*text, robot_, device_, arm);
  } catch (const PositionError& error) {
    throw PositionError(file_.string() + ": " + error.what(), error.held(), error.in_error());
  }
}

void PositionStore::save(const LastPosition& position, const ArmModel& arm) const {
  const std::string text = position_text(position, arm);
  try {
    replace_private(file_, fresh_, text);
  } catch (const std::system_error&) {
    empty_private(file_);
    throw;
  }
}

}  // namespace corbot
