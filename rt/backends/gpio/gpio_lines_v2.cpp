// SPDX-License-Identifier: Apache-2.0
// For libgpiod 2 (Debian 13).
#include <gpiod.h>
#include <time.h>

#include <array>

#include "rt/backends/gpio/gpio_fault.h"
#include "rt/backends/gpio/gpio_lines.h"

namespace corbot::rt {
namespace {

template <auto Free>
struct Release {
  template <class Object>
  void operator()(Object* object) const {
    Free(object);
  }
};
using Chip = std::unique_ptr<gpiod_chip, Release<gpiod_chip_close>>;
using LineInfo = std::unique_ptr<gpiod_line_info, Release<gpiod_line_info_free>>;
using Settings = std::unique_ptr<gpiod_line_settings, Release<gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, Release<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, Release<gpiod_request_config_free>>;
using LineRequest = std::unique_ptr<gpiod_line_request, Release<gpiod_line_request_release>>;
using Events = std::unique_ptr<gpiod_edge_event_buffer, Release<gpiod_edge_event_buffer_free>>;

constexpr std::size_t kMostEvents = 16;

Chip open_chip(const std::string& path) {
  Chip chip(gpiod_chip_open(path.c_str()));
  if (!chip) throw gpio_chip_error(path, errno);
  return chip;
}

unsigned find_line(gpiod_chip* chip, const std::string& path, const std::string& name) {
  if (const auto offset = gpio_offset(name)) {
    if (LineInfo(gpiod_chip_get_line_info(chip, *offset))) return *offset;
    throw gpio_no_line(path, name);
  }
  const int offset = gpiod_chip_get_line_offset_from_name(chip, name.c_str());
  if (offset < 0) throw gpio_no_line(path, name);
  return static_cast<unsigned>(offset);
}

/// Returns the consumer of a line; nothing if it is free.
std::optional<std::string> user_of(gpiod_chip* chip, unsigned offset) {
  const LineInfo info(gpiod_chip_get_line_info(chip, offset));
  if (!info || !gpiod_line_info_is_used(info.get())) return std::nullopt;
  const char* consumer = gpiod_line_info_get_consumer(info.get());
  return consumer != nullptr ? consumer : "";
}

gpiod_line_bias bias_of(GpioBias bias) {
  switch (bias) {
    case GpioBias::kDisabled:
      return GPIOD_LINE_BIAS_DISABLED;
    case GpioBias::kPullUp:
      return GPIOD_LINE_BIAS_PULL_UP;
    case GpioBias::kPullDown:
      return GPIOD_LINE_BIAS_PULL_DOWN;
    case GpioBias::kAsIs:
      break;
  }
  return GPIOD_LINE_BIAS_AS_IS;
}

enum class Use { kOutput, kInput, kInputWithEdges };

LineRequest request_lines(gpiod_chip* chip, const GpioRequest& request, const std::vector<unsigned>& offsets,
                          Use use) {
  const Settings settings(gpiod_line_settings_new());
  const LineConfig lines(gpiod_line_config_new());
  const RequestConfig config(gpiod_request_config_new());
  if (!settings || !lines || !config) throw gpio_chip_error(request.chip, ENOMEM);
  gpiod_line_settings_set_active_low(settings.get(), request.active_low);
  if (use == Use::kOutput) {
    gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_OUTPUT);
    gpiod_line_settings_set_output_value(settings.get(), GPIOD_LINE_VALUE_INACTIVE);
  } else {
    gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_INPUT);
    gpiod_line_settings_set_bias(settings.get(), bias_of(request.bias));
    gpiod_line_settings_set_edge_detection(
        settings.get(), use == Use::kInputWithEdges ? GPIOD_LINE_EDGE_BOTH : GPIOD_LINE_EDGE_NONE);
  }
  if (gpiod_line_config_add_line_settings(lines.get(), offsets.data(), offsets.size(), settings.get()) != 0) {
    throw gpio_chip_error(request.chip, errno);
  }
  gpiod_request_config_set_consumer(config.get(), request.consumer.c_str());
  return LineRequest(gpiod_chip_request_lines(chip, config.get(), lines.get()));
}

class Outputs final : public GpioOutputs {
 public:
  explicit Outputs(const GpioRequest& request) {
    const Chip chip = open_chip(request.chip);
    std::vector<unsigned> offsets;
    for (const std::string& name : request.lines) {
      offsets.push_back(find_line(chip.get(), request.chip, name));
      if (const auto user = user_of(chip.get(), offsets.back())) {
        throw gpio_line_taken(request.chip, name, *user);
      }
    }
    values_.resize(offsets.size(), GPIOD_LINE_VALUE_INACTIVE);
    request_ = request_lines(chip.get(), request, offsets, Use::kOutput);
    if (!request_) throw gpio_line_error(request.chip, request.lines.front() + " ...", errno);
  }
  [[nodiscard]] int set(std::uint32_t values) noexcept override {
    for (std::size_t i = 0; i < values_.size(); ++i) {
      values_[i] = (values >> i & 1u) != 0 ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
    }
    return gpiod_line_request_set_values(request_.get(), values_.data()) == 0 ? 0 : errno;
  }

 private:
  LineRequest request_;
  std::vector<gpiod_line_value> values_;
};

class Input final : public GpioInput {
 public:
  explicit Input(const GpioRequest& request) : path_(request.chip) {
    const Chip chip = open_chip(request.chip);
    const std::string& name = request.lines.at(0);
    offset_ = find_line(chip.get(), request.chip, name);
    if (const auto user = user_of(chip.get(), offset_)) throw gpio_line_taken(request.chip, name, *user);
    request_ = request_lines(chip.get(), request, {offset_}, Use::kInputWithEdges);
    if (request_) {
      events_.reset(gpiod_edge_event_buffer_new(kMostEvents));
      if (!events_) throw gpio_chip_error(request.chip, ENOMEM);
      return;
    }
    request_ = request_lines(chip.get(), request, {offset_}, Use::kInput);  // no interrupt: read often
    if (!request_) throw gpio_line_error(request.chip, name, errno);
  }
  bool wait_edge(std::chrono::nanoseconds longest) override {
    if (!events_) {
      const timespec time{0, static_cast<long>(longest.count() % 1'000'000'000)};
      (void)::nanosleep(&time, nullptr);
      return false;
    }
    const int count = gpiod_line_request_wait_edge_events(request_.get(), longest.count());
    if (count < 0 && errno != EINTR) throw gpio_lost(path_, errno);
    if (count <= 0) return false;
    if (gpiod_line_request_read_edge_events(request_.get(), events_.get(), kMostEvents) < 0) {
      throw gpio_lost(path_, errno);
    }
    return true;
  }
  [[nodiscard]] bool is_active() override {
    const gpiod_line_value value = gpiod_line_request_get_value(request_.get(), offset_);
    if (value == GPIOD_LINE_VALUE_ERROR) throw gpio_lost(path_, errno);
    return value == GPIOD_LINE_VALUE_ACTIVE;
  }

 private:
  std::string path_;
  unsigned offset_{0};
  LineRequest request_;
  Events events_;
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
    const LineInfo found(gpiod_chip_get_line_info(chip.get(), find_line(chip.get(), path, name)));
    if (!found) throw gpio_no_line(path, name);
    GpioLineInfo info;
    if (gpiod_line_info_is_used(found.get())) {
      const char* consumer = gpiod_line_info_get_consumer(found.get());
      info.consumer = consumer != nullptr ? consumer : "";
    }
    info.is_output = gpiod_line_info_get_direction(found.get()) == GPIOD_LINE_DIRECTION_OUTPUT;
    return info;
  }
};

}  // namespace

std::unique_ptr<GpioChips> kernel_gpio() { return std::make_unique<KernelGpio>(); }

}  // namespace corbot::rt
