// SPDX-License-Identifier: Apache-2.0
// For libgpiod 1.5 and 1.6 (Debian 12).
#include <gpiod.h>
#include <time.h>

#include <array>

#include "rt/backends/gpio/gpio_fault.h"
#include "rt/backends/gpio/gpio_lines.h"

namespace corbot::rt {
namespace {

constexpr std::size_t kMostEvents = 16;

struct CloseChip {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};
using Chip = std::unique_ptr<gpiod_chip, CloseChip>;

Chip open_chip(const std::string& path) {
  Chip chip(gpiod_chip_open(path.c_str()));
  if (!chip) throw gpio_chip_error(path, errno);
  return chip;
}

gpiod_line* find_line(gpiod_chip* chip, const std::string& path, const std::string& name) {
  const auto offset = gpio_offset(name);
  gpiod_line* line = offset ? gpiod_chip_get_line(chip, *offset) : gpiod_chip_find_line(chip, name.c_str());
  if (line == nullptr) throw gpio_no_line(path, name);
  return line;
}

DeviceError refused(const GpioRequest& request, const std::string& name, gpiod_line* line, int error) {
  if (error != EBUSY) return gpio_line_error(request.chip, name, error);
  const char* consumer = gpiod_line_consumer(line);
  return gpio_line_taken(request.chip, name, consumer != nullptr ? consumer : "");
}

int flags_of(const GpioRequest& request) {
  int flags = request.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  switch (request.bias) {
    case GpioBias::kDisabled:
      return flags | GPIOD_LINE_REQUEST_FLAG_BIAS_DISABLE;
    case GpioBias::kPullUp:
      return flags | GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
    case GpioBias::kPullDown:
      return flags | GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
    case GpioBias::kAsIs:
      break;
  }
  return flags;
}

timespec duration_of(std::chrono::nanoseconds time) {
  timespec result{};
  result.tv_sec = static_cast<time_t>(time.count() / 1'000'000'000);
  result.tv_nsec = static_cast<long>(time.count() % 1'000'000'000);
  return result;
}

class Outputs final : public GpioOutputs {
 public:
  explicit Outputs(const GpioRequest& request) : chip_(open_chip(request.chip)) {
    gpiod_line_bulk_init(&lines_);
    for (const std::string& name : request.lines) {
      gpiod_line* line = find_line(chip_.get(), request.chip, name);
      if (gpiod_line_is_used(line)) throw refused(request, name, line, EBUSY);
      gpiod_line_bulk_add(&lines_, line);
    }
    gpiod_line_request_config config{};
    config.consumer = request.consumer.c_str();
    config.request_type = GPIOD_LINE_REQUEST_DIRECTION_OUTPUT;
    config.flags = flags_of(request);
    const std::array<int, GPIOD_LINE_BULK_MAX_LINES> inactive{};
    if (gpiod_line_request_bulk(&lines_, &config, inactive.data()) != 0) {
      throw gpio_line_error(request.chip, request.lines.front() + " ...", errno);
    }
  }
  [[nodiscard]] int set(std::uint32_t values) noexcept override {
    std::array<int, GPIOD_LINE_BULK_MAX_LINES> all{};
    for (unsigned i = 0; i < lines_.num_lines; ++i) all[i] = static_cast<int>(values >> i & 1u);
    return gpiod_line_set_value_bulk(&lines_, all.data()) == 0 ? 0 : errno;
  }

 private:
  Chip chip_;  // closing it releases its lines
  gpiod_line_bulk lines_{};
};

class Input final : public GpioInput {
 public:
  explicit Input(const GpioRequest& request)
      : path_(request.chip),
        chip_(open_chip(request.chip)),
        line_(find_line(chip_.get(), request.chip, request.lines.at(0))) {
    gpiod_line_request_config config{};
    config.consumer = request.consumer.c_str();
    config.request_type = GPIOD_LINE_REQUEST_EVENT_BOTH_EDGES;
    config.flags = flags_of(request);
    if (gpiod_line_request(line_, &config, 0) == 0) {
      has_edges_ = true;
      return;
    }
    if (errno == EBUSY) throw refused(request, request.lines[0], line_, EBUSY);
    config.request_type = GPIOD_LINE_REQUEST_DIRECTION_INPUT;  // no interrupt: read often
    if (gpiod_line_request(line_, &config, 0) != 0) throw refused(request, request.lines[0], line_, errno);
  }
  bool wait_edge(std::chrono::nanoseconds longest) override {
    timespec time = duration_of(longest);
    if (!has_edges_) {
      (void)::nanosleep(&time, nullptr);
      return false;
    }
    const int count = gpiod_line_event_wait(line_, &time);
    if (count < 0 && errno != EINTR) throw gpio_lost(path_, errno);
    if (count <= 0) return false;
    std::array<gpiod_line_event, kMostEvents> events{};
    const auto most = static_cast<unsigned>(events.size());
    if (gpiod_line_event_read_multiple(line_, events.data(), most) < 0) throw gpio_lost(path_, errno);
    return true;
  }
  [[nodiscard]] bool is_active() override {
    const int value = gpiod_line_get_value(line_);
    if (value < 0) throw gpio_lost(path_, errno);
    return value != 0;
  }

 private:
  std::string path_;
  Chip chip_;
  gpiod_line* line_;
  bool has_edges_{false};
};

class KernelGpio final : public GpioChips {
 public:
  [[nodiscard]] std::unique_ptr<GpioOutputs> outputs(const GpioRequest& request) override {
    return std::make_unique<Outputs>(request);
  }
  [[nodiscard]] std::unique_ptr<GpioInput> input(const GpioRequest& request) override {
    return std::make_unique<Input>(request);
  }
  [[nodiscard]] GpioLineInfo info(const std::string& path, const std::string& name) override {
    const Chip chip = open_chip(path);
    gpiod_line* line = find_line(chip.get(), path, name);
    GpioLineInfo info;
    if (gpiod_line_is_used(line)) {
      const char* consumer = gpiod_line_consumer(line);
      info.consumer = consumer != nullptr ? consumer : "";
    }
    info.is_output = gpiod_line_direction(line) == GPIOD_LINE_DIRECTION_OUTPUT;
    return info;
  }
};

}  // namespace

std::unique_ptr<GpioChips> kernel_gpio() { return std::make_unique<KernelGpio>(); }

}  // namespace corbot::rt
