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
  /// SCHED_FIFO of the thread that times the pulses; 0: an ordinary thread. Above the cycle's: an edge that
  /// waits for the cycle's step is a twitch of the servo, while the cycle does not notice the microseconds of
  /// an edge.
  int priority{0};
  int cpu{-1};  ///< −1: any
  /// The thread sleeps until so long before a pulse ends, and then watches the clock: a wake-up that is late
  /// by less costs the pulse nothing. 0: it sleeps to the end.
  std::int64_t awake_ns{50'000};
};

/// Servo pulses on GPIO lines, made by a thread of its own: raise, sleep to shortly before an absolute
/// deadline, wait for it, lower. A pulse's length counts from when its line really rose, and the fall is
/// begun as much earlier as setting lines takes at its quickest, so only the fall's lateness is its error,
/// and that never shortens it. Nominal resolution 1 ns; what a pulse is really worth is given by lateness().
/// The pulses end with the thread.
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
  /// Throws for an edge that could not be made.
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
  std::int64_t quickest_set_ns_{};  ///< of the pulses' thread: how long setting lines takes
  std::atomic<int> error_{0};       ///< errno of an edge that could not be made; the thread has ended then
  std::atomic<bool> end_{false};
  std::atomic<int> is_realtime_{-1};  ///< −1: not known yet
  std::string log_;                   ///< of the thread that calls, not of the one that times
  std::chrono::steady_clock::time_point next_report_{};
  std::thread thread_;
};

}  // namespace corbot::rt
