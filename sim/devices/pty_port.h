// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace corbot::sim {

/// The device's end of a pseudo-terminal. Programs open the other end by a symbolic link, as they would a
/// serial port. Failures of opening throw std::runtime_error.
class PtyPort {
 public:
  /// Takes the speed of the device's line: the other end has it, too, until a program sets another.
  PtyPort(std::string link, int baud) : link_(std::move(link)), baud_(baud) {}
  PtyPort(const PtyPort&) = delete;
  PtyPort& operator=(const PtyPort&) = delete;
  ~PtyPort() { close(); }

  /// Makes the pseudo-terminal and the link; an old symbolic link is replaced, nothing else.
  void open();
  /// Hangs up the other end. Removes the link, unless another program has replaced it.
  void close() noexcept;
  [[nodiscard]] bool is_open() const { return device_fd_ >= 0; }
  [[nodiscard]] const std::string& link() const { return link_; }

  /// Returns the descriptor to be polled: readable if bytes have come in.
  [[nodiscard]] int fd() const { return device_fd_; }
  /// Reads the available bytes, without waiting.
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> into) const;
  /// Writes bytes; those that do not fit are lost, as on a line without a reader.
  void write(std::span<const std::uint8_t> bytes) const;

  /// Tells whether a program has set the other end to another speed; false for speeds that termios does not
  /// have.
  [[nodiscard]] bool is_wrong_baud() const;

  /// Returns the descriptor to be polled, −1 if there is none: readable if the other end has been closed.
  [[nodiscard]] int closed_fd() const { return watch_fd_; }
  /// Lets the next program open the other end, even if the last one died with exclusive use of it.
  void after_closed() const;

 private:
  void make_link();
  [[noreturn]] void fail(const std::string& what);

  std::string link_;
  int baud_;
  std::string name_;
  int device_fd_{-1};
  /// Keeps the other end open here, too. Otherwise it would be hung up whenever no program has it open, and
  /// forget its settings.
  int host_fd_{-1};
  int watch_fd_{-1};
};

}  // namespace corbot::sim
