// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "shm/descriptor.h"

namespace corbot::cli {

/// The descriptors that a child gets back when it is restarted, like systemd's FileDescriptorStoreMax= for a
/// service.
class DescriptorStore {
 public:
  static constexpr std::size_t kCapacity = 16;
  /// Stored descriptors lie above those that a child receives, so that the hand-over never overwrites one.
  static constexpr int kFirstPassed = 3;  ///< SD_LISTEN_FDS_START
  static constexpr int kFirstFree = kFirstPassed + static_cast<int>(kCapacity);

  struct Item {
    std::string name;
    Descriptor fd;
  };

  enum class Added { kNew, kAlreadyThere, kFull, kFailed };
  /// Adds a descriptor. `name` as in FDNAME=; a name that systemd refuses becomes "stored", as in systemd.
  /// Stores the same open file once.
  Added add(const std::string& name, Descriptor fd);
  /// Removes all descriptors of that name; returns their number.
  std::size_t remove(std::string_view name);

  [[nodiscard]] const std::vector<Item>& items() const noexcept { return items_; }
  /// Returns the names for LISTEN_FDNAMES=, joined by colons.
  [[nodiscard]] std::string names() const;

 private:
  std::vector<Item> items_;
};

/// Moves a descriptor above those that a child receives; returns −1 with errno if none is free.
[[nodiscard]] Descriptor above_passed(Descriptor fd) noexcept;

}  // namespace corbot::cli
