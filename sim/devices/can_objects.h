// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>

namespace corbot::sim {

// The reasons for refusing an access: CiA 301, table 22.
inline constexpr std::uint32_t kAbortToggle = 0x0503'0000;
inline constexpr std::uint32_t kAbortCommand = 0x0504'0001;
inline constexpr std::uint32_t kAbortWriteOnly = 0x0601'0001;
inline constexpr std::uint32_t kAbortReadOnly = 0x0601'0002;
inline constexpr std::uint32_t kAbortNoObject = 0x0602'0000;
inline constexpr std::uint32_t kAbortNotMappable = 0x0604'0041;
inline constexpr std::uint32_t kAbortPdoLength = 0x0604'0042;
inline constexpr std::uint32_t kAbortTooLong = 0x0607'0012;
inline constexpr std::uint32_t kAbortTooShort = 0x0607'0013;
inline constexpr std::uint32_t kAbortNoSubIndex = 0x0609'0011;
inline constexpr std::uint32_t kAbortRange = 0x0609'0030;
inline constexpr std::uint32_t kAbortTooHigh = 0x0609'0031;
inline constexpr std::uint32_t kAbortTooLow = 0x0609'0032;
inline constexpr std::uint32_t kAbortGeneral = 0x0800'0000;
inline constexpr std::uint32_t kAbortState = 0x0800'0022;

enum class Access { kReadOnly, kWriteOnly, kReadWrite };

/// An entry of an object dictionary: a number of 1, 2 or 4 bytes, or a text.
struct CanObject {
  unsigned bytes{4};  ///< 0: a text
  bool is_signed{false};
  Access access{Access::kReadOnly};
  std::int64_t value{0};
  std::int64_t lowest{std::numeric_limits<std::int64_t>::min()};
  std::int64_t highest{std::numeric_limits<std::int64_t>::max()};
  bool goes_into_rpdo{false};
  bool goes_into_tpdo{false};
  std::string text{};
  bool is_hidden{false};  ///< hidden from all but the device itself
};

/// Index and sub-index in one number: 0x60C201 is 60C2h:1.
using ObjectKey = std::uint32_t;

/// The object dictionary of a CANopen device, and its rules of access.
class CanObjects {
 public:
  void add(ObjectKey key, CanObject object) { objects_[key] = std::move(object); }
  /// Hides these objects, as if they did not exist.
  void hide(const std::function<bool(ObjectKey)>& is_hidden);
  /// Returns null if there is no such object.
  [[nodiscard]] const CanObject* find(ObjectKey key) const;
  [[nodiscard]] std::int64_t value(ObjectKey key) const;
  /// Sets a value by the device itself, past all rules.
  void set(ObjectKey key, std::int64_t value);

  /// Returns why it cannot be read; 0: it can.
  [[nodiscard]] std::uint32_t check_read(ObjectKey key) const;
  /// Returns why these bytes cannot be written; 0: they can. `bytes` 0: length not given.
  [[nodiscard]] std::uint32_t check_write(ObjectKey key, std::uint32_t raw, unsigned bytes) const;
  /// Returns the number that these raw bytes mean for the object.
  [[nodiscard]] std::int64_t number(ObjectKey key, std::uint32_t raw) const;

 private:
  [[nodiscard]] std::uint32_t missing(ObjectKey key) const;

  std::map<ObjectKey, CanObject> objects_;
};

}  // namespace corbot::sim
