// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "corbot/channel/snapshot_cell.h"
#include "rt/backends/bus/bus_device.h"
#include "rt/backends/gpio/gpio_lines.h"
#include "rt/backends/gpio/pulse_plan.h"

namespace corbot::rt {

struct GpiodSettings {
  std::string chip;                ///< /dev/gpiochipN
  std::vector<std::string> lines;  ///< by channel: names or offsets
  double frame_hz{50.0};
  PulseOrder order{PulseOrder::kStaggered};
  /// SCHED_FIFO of the thread that times the pulses; 0: an ordinary thread. It is above the cycle's priority.
  /// If an edge waits for the cycle's step, the servo twitches, but the cycle does not notice the
  /// microseconds of an edge.
  int priority{0};
  int cpu{-1};  ///< −1: any
  /// The thread sleeps until this time before a pulse ends, and then polls the clock. A wake-up late by less
  /// costs the pulse nothing. 0: it sleeps to the end.
  std::int64_t awake_ns{50'000};
};

/// Servo pulses on GPIO lines, made by a thread of its own: raise, sleep to shortly before an absolute
/// deadline, poll, lower. A pulse's length counts from the real rise of its line. The fall begins earlier by
/// the quickest time of setting lines. So only the fall's lateness is its error, and never shortens it.
/// Nominal resolution 1 ns; lateness() gives the real errors. The pulses end with the thread.
class Gpiod final : public BusDevice {
 public:
  Gpiod(GpiodSettings settings, std::unique_ptr<GpioChips> chips);
  ~Gpiod() override { close(); }

  std::string open() override;
  void close() noexcept override;
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return frame_ns_; }
  bool send(const ServoFrame& frame, bool approach) override;
  BusReading measure(const ServoFrame& frame) override;
  void relax() override { widths_.store(PulseWidths{}); }
  [[nodiscard]] std::string drain_log() override;

  [[nodiscard]] const EdgeLateness& lateness() const noexcept { return lateness_; }

 private:
  /// Throws for a failed edge.
  void check_edges() const;
  void run() noexcept;
  void make_frame(const PulsePlan& plan, std::int64_t begin_ns) noexcept;
  void time_setting() noexcept;
  void lower_at(std::int64_t due_ns, std::uint32_t high) noexcept;
  void set(std::uint32_t lines) noexcept;
  [[nodiscard]] bool take_priority() noexcept;

  GpiodSettings settings_;
  std::unique_ptr<GpioChips> chips_;
  std::int64_t frame_ns_;
  std::unique_ptr<GpioOutputs> outputs_;
  SnapshotCell<PulseWidths> widths_;
  EdgeLateness lateness_;
  std::int64_t quickest_set_ns_{};  ///< for the pulses' thread: the quickest time of setting lines
  std::atomic<int> error_{0};       ///< errno of a failed edge; the thread has ended then
  std::atomic<bool> end_{false};
  std::atomic<int> is_realtime_{-1};  ///< −1: not known yet
  std::string log_;                   ///< of the calling thread, not of the timing one
  std::chrono::steady_clock::time_point next_report_{};
  std::thread thread_;
};

}  // namespace corbot::rt
