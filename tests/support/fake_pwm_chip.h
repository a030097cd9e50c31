// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>

namespace corbot::test {

/// A tree of files that behaves like the kernel's PWM in sysfs; a thread plays the kernel.
class FakePwmChip {
 public:
  explicit FakePwmChip(std::filesystem::path root) : root_(std::move(root)), chip_(root_ / "pwmchip0") {
    plug_in();
    kernel_ = std::jthread([this](const std::stop_token& end) { play_kernel(end); });
  }

  [[nodiscard]] const std::filesystem::path& chip() const { return chip_; }
  void plug_in() {
    std::filesystem::create_directories(chip_);
    put(chip_ / "npwm", "16");
    put(chip_ / "export", "");
    put(chip_ / "unexport", "");
  }
  /// Exports what is asked for, the files at first without permission, as before udev's rule.
  void play_kernel(const std::stop_token& end) {
    while (!end.stop_requested()) {
      if (const std::string wanted = get(chip_ / "export"); !wanted.empty()) {
        put(chip_ / "export", "");
        make_output(wanted);
      }
      if (const std::string wanted = get(chip_ / "unexport"); !wanted.empty()) {
        put(chip_ / "unexport", "");
        std::filesystem::remove_all(chip_ / ("pwm" + wanted));
      }
      ++rounds_;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  /// Until what was written before is carried out; the real kernel has done it when the write returns.
  void settle() const {
    const std::uint64_t before = rounds_;
    while (rounds_ < before + 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  void make_output(const std::string& number) const {
    const std::filesystem::path hidden = root_ / ("new" + number);
    std::filesystem::create_directories(hidden);
    for (const auto& [name, value] :
         {std::pair{"period", "0"}, {"duty_cycle", "0"}, {"polarity", "normal"}}) {
      put(hidden / name, value);
    }
    std::filesystem::rename(hidden, chip_ / ("pwm" + number));
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    // Comes last, and later; whole, as sysfs never shows half a file.
    put(root_ / "enable", "0");
    std::filesystem::rename(root_ / "enable", chip_ / ("pwm" + number) / "enable");
  }
  static void put(const std::filesystem::path& file, const std::string& text) {
    std::ofstream(file) << text << (text.empty() ? "" : "\n");
  }
  static std::string get(const std::filesystem::path& file) {
    std::ifstream stream(file);
    std::string line;
    std::getline(stream, line);
    return line;
  }
  [[nodiscard]] std::string of(int channel, const std::string& name) const {
    return get(chip_ / ("pwm" + std::to_string(channel)) / name);
  }
  /// The controller goes, and what was open of it is dead.
  void unplug() {
    std::filesystem::remove_all(root_ / "unbound");
    std::filesystem::rename(chip_, root_ / "unbound");
  }

 protected:
  std::filesystem::path root_;
  std::filesystem::path chip_;

 private:
  std::atomic<std::uint64_t> rounds_{0};
  std::jthread kernel_;
};

}  // namespace corbot::test
