// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace corbot::panel {

/// The secrets of one panel, 128 bits each, in hexadecimal figures.
struct Tokens {
  std::string watch;  ///< allows to watch and to stop
  std::string drive;  ///< allows all of that, and to move the robots
};

/// Returns new tokens from the kernel's random numbers. Throws client::Failure.
[[nodiscard]] Tokens new_tokens();

/// A file of this user alone, mode 0600, with one line for each token: "watch TOKEN" and "drive TOKEN". It
/// exists as long as the object, which keeps it locked.
class TokenFile {
 public:
  /// Creates the file. Throws client::Failure, also if the file exists.
  TokenFile(std::filesystem::path path, const Tokens& tokens);
  TokenFile(const TokenFile&) = delete;
  TokenFile& operator=(const TokenFile&) = delete;
  ~TokenFile();
  /// Removes the file of a panel that was killed; leaves that of a panel that runs.
  static void remove_stale(const std::filesystem::path& path);

 private:
  std::filesystem::path path_;
  int fd_;
};

}  // namespace corbot::panel
