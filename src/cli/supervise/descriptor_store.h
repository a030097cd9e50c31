// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "shm/descriptor.h"

namespace corbot::cli {

/// The descriptors that a child wants back when it is started again: what systemd's FileDescriptorStoreMax=
/// is to a service.
class DescriptorStore {
 public:
  static constexpr std::size_t kCapacity = 16;
  /// Descriptors are kept above those that a child receives, so that handing over never overwrites one.
  static constexpr int kFirstPassed = 3;  ///< SD_LISTEN_FDS_START
  static constexpr int kFirstFree = kFirstPassed + static_cast<int>(kCapacity);

  struct Item {
    std::string name;
    Descriptor fd;
  };

  enum class Added { kNew, kAlreadyThere, kFull, kFailed };
  /// `name` as of FDNAME=; one that systemd would not take becomes "stored", as there. The same open file is
  /// kept once.
  Added add(const std::string& name, Descriptor fd);
  /// All of that name; how many they were.
  std::size_t remove(std::string_view name);

  [[nodiscard]] const std::vector<Item>& items() const noexcept { return items_; }
  /// For LISTEN_FDNAMES=: joined by colons.
  [[nodiscard]] std::string names() const;

 private:
  std::vector<Item> items_;
};

/// Moves a descriptor above those that a child receives; −1 with errno when there is none left.
[[nodiscard]] Descriptor above_passed(Descriptor fd) noexcept;

}  // namespace corbot::cli
