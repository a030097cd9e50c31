// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace corbot::rt {

/// A chip with registers on an I2C bus, as far as SMBus goes. It transfers single bytes, and blocks of up to
/// 32 without a count (I2C_SMBUS_I2C_BLOCK_DATA). Not real-time safe; every failure throws DeviceError.
class I2cBus {
 public:
  static constexpr std::size_t kLongestBlock = 32;

  I2cBus() = default;
  I2cBus(const I2cBus&) = delete;
  I2cBus& operator=(const I2cBus&) = delete;
  virtual ~I2cBus() = default;

  virtual void open() = 0;
  virtual void close() noexcept = 0;
  /// Returns bus and address, for messages.
  [[nodiscard]] virtual const std::string& name() const noexcept = 0;
  virtual void write(std::uint8_t first, std::span<const std::uint8_t> bytes) = 0;
  virtual void read(std::uint8_t first, std::span<std::uint8_t> into) = 0;
};

/// A chip on /dev/i2c-N. It refuses an address that a driver of the kernel uses, and does not force it.
class I2cDev final : public I2cBus {
 public:
  I2cDev(const std::string& path, int address);
  ~I2cDev() override { close(); }

  void open() override;
  void close() noexcept override;
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }
  void write(std::uint8_t first, std::span<const std::uint8_t> bytes) override;
  void read(std::uint8_t first, std::span<std::uint8_t> into) override;

 private:
  void transfer(std::uint8_t direction, std::uint8_t first, std::uint32_t size, void* data);

  std::string path_;
  int address_;
  std::string name_;
  int fd_{-1};
};

}  // namespace corbot::rt
