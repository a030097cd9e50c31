// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/pwm/i2c_bus.h"

#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "rt/backends/bus/device_error.h"

namespace corbot::rt {
namespace {

std::string hexadecimal(int address) {
  static constexpr char kDigits[] = "0123456789abcdef";
  return {'0', 'x', kDigits[(address >> 4) & 0xF], kDigits[address & 0xF]};
}

/// Returns the cause for the kernel's fault code. A failed transfer may be noise; an address without
/// acknowledge or a missing adapter is not.
DeviceCause cause_of(int error) {
  switch (error) {
    case ENXIO:
      return DeviceCause::kNotThere;
    case ENODEV:
    case EBADF:
      return DeviceCause::kHungUp;
    default:
      return DeviceCause::kNoAnswer;
  }
}

std::string words_of(int error) {
  switch (error) {
    case ENXIO:
      return "no chip acknowledges this address: is it powered, are SDA and SCL right?";
    case ENODEV:
      return "the I2C adapter was removed";
    case EREMOTEIO:
      return "the chip did not acknowledge";
    case ETIMEDOUT:
      return "the bus is stuck: is SDA or SCL held low?";
    default:
      return std::strerror(error);
  }
}

}  // namespace

I2cDev::I2cDev(const std::string& path, int address)
    : path_(path), address_(address), name_(path + " " + hexadecimal(address)) {}

void I2cDev::open() {
  close();
  fd_ = ::open(path_.c_str(), O_RDWR | O_CLOEXEC);
  if (fd_ < 0) {
    const std::string hint = errno == EACCES ? " (join the group i2c, or install the udev rule)" : "";
    throw DeviceError(DeviceCause::kNotThere, path_ + ": " + std::strerror(errno) + hint);
  }
  constexpr unsigned long kNeeded = I2C_FUNC_SMBUS_BYTE_DATA | I2C_FUNC_SMBUS_I2C_BLOCK;
  unsigned long functions = 0;
  if (::ioctl(fd_, I2C_FUNCS, &functions) != 0 || (functions & kNeeded) != kNeeded) {
    close();
    throw DeviceError(DeviceCause::kNotThere, path_ + ": is not an I2C adapter that can write blocks");
  }
  if (::ioctl(fd_, I2C_SLAVE, static_cast<unsigned long>(address_)) != 0) {
    const int error = errno;
    close();
    if (error == EBUSY) {
      throw DeviceError(
          DeviceCause::kInUse,
          name_ + ": a driver of the kernel has this address; use kind = \"pwm_sysfs\", or unbind it");
    }
    throw DeviceError(DeviceCause::kNotThere, name_ + ": " + std::strerror(error));
  }
}

void I2cDev::close() noexcept {
  if (fd_ >= 0) ::close(std::exchange(fd_, -1));
}

void I2cDev::transfer(std::uint8_t direction, std::uint8_t first, std::uint32_t size, void* data) {
  i2c_smbus_ioctl_data request{};
  request.read_write = direction;
  request.command = first;
  request.size = size;
  request.data = static_cast<i2c_smbus_data*>(data);
  if (::ioctl(fd_, I2C_SMBUS, &request) == 0) return;
  const int error = errno;
  throw DeviceError(cause_of(error), name_ + ": " + words_of(error));
}

void I2cDev::write(std::uint8_t first, std::span<const std::uint8_t> bytes) {
  i2c_smbus_data data{};
  if (bytes.size() == 1) {
    data.byte = bytes[0];
    transfer(I2C_SMBUS_WRITE, first, I2C_SMBUS_BYTE_DATA, &data);
    return;
  }
  const std::size_t count = std::min(bytes.size(), kLongestBlock);
  data.block[0] = static_cast<std::uint8_t>(count);
  std::copy_n(bytes.begin(), count, data.block + 1);
  transfer(I2C_SMBUS_WRITE, first, I2C_SMBUS_I2C_BLOCK_DATA, &data);
}

void I2cDev::read(std::uint8_t first, std::span<std::uint8_t> into) {
  i2c_smbus_data data{};
  if (into.size() == 1) {
    transfer(I2C_SMBUS_READ, first, I2C_SMBUS_BYTE_DATA, &data);
    into[0] = data.byte;
    return;
  }
  const std::size_t count = std::min(into.size(), kLongestBlock);
  data.block[0] = static_cast<std::uint8_t>(count);
  transfer(I2C_SMBUS_READ, first, I2C_SMBUS_I2C_BLOCK_DATA, &data);
  if (data.block[0] < count)
    throw DeviceError(DeviceCause::kBadAnswer, name_ + ": the chip sent a block that is too short");
  std::copy_n(data.block + 1, count, into.begin());
}

}  // namespace corbot::rt
