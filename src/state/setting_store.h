// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "corbot/arm/arm_model.h"
#include "state/last_position.h"
#include "state/private_file.h"

namespace corbot {

/// A fault of a saved setting. Its values are then unknown; the fault does not mean that there were none.
class SettingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A robot, and the device (`kind` of [backend]) that moves it.
struct SettingOwner {
  std::string robot, device;
};

/// The file DIRECTORY/STEM.SUFFIX of one setting, see state_file_stem(), which only the servant writes.
/// `Text` has the type of the value, its suffix, and the value as text. Not real-time safe.
template <class Text>
class SettingStore {
 public:
  using Value = typename Text::Value;

  /// Throws std::invalid_argument for a name that no robot can have.
  SettingStore(const std::filesystem::path& directory, std::string robot, std::string device)
      : file_(directory / (state_file_stem(robot, device) + Text::kSuffix)),
        fresh_(file_.string() + ".servant"),
        owner_{std::move(robot), std::move(device)} {
    if (!is_file_name(owner_.robot))
      throw std::invalid_argument("'" + owner_.robot + "' is not the name of a robot");
  }

  /// Returns nothing if there is no such file. Throws SettingError for every invalid file, including one that
  /// other users may write to, or that is unreadable.
  [[nodiscard]] std::optional<Value> load(const ArmModel& arm) const {
    std::optional<std::string> text;
    try {
      text = read_private(file_, Text::kMostBytes);
    } catch (const std::runtime_error& error) {
      throw SettingError(error.what());
    }
    if (!text) return std::nullopt;
    try {
      return Text::read(*text, owner_, arm);
    } catch (const SettingError& error) {
      throw SettingError(file_.string() + ": " + error.what());
    }
  }
  /// Saves the value completely or not at all; without a value removes the file. Throws std::system_error.
  void save(const std::optional<Value>& value, const ArmModel& arm) const {
    put(value ? std::optional(Text::write(*value, owner_, arm)) : std::nullopt);
  }
  /// Returns the file's text, or nothing if there is no such file. An unreadable file has a text that load()
  /// refuses.
  [[nodiscard]] std::optional<std::string> text() const {
    try {
      return read_private(file_, Text::kMostBytes);
    } catch (const std::runtime_error&) {
      return "# not known: to be set or reset\n";
    }
  }
  /// Saves a text completely or not at all; without a text removes the file. Throws std::system_error.
  void put(const std::optional<std::string>& text) const {
    if (!text) return remove_private(file_);
    replace_private(file_, fresh_, *text);
  }

 private:
  std::filesystem::path file_;
  std::filesystem::path fresh_;
  SettingOwner owner_;
};

}  // namespace corbot
