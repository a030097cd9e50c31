// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "../../support/test_arms.h"
#include "corbot/channel/layout.h"
#include "planner/planner.h"
#include "rt/backends/loopback/loopback_backend.h"
#include "rt/cycle/cycle.h"

namespace corbot::test {

inline ArmModel shipped_lynx5() {
  static const ArmModel arm = arm_of("lynx5");
  return arm;
}

/// The chain below the servant, without clock, process or shared memory: planner → ring → cycle → loopback
/// backend. The test plays the servant, and hands the segments over.
class Rig {
 public:
  explicit Rig(const ArmModel& model = shipped_lynx5()) : arm(model), planner(model), backend(model, {}) {
    restart();
  }
  /// A task over another device, which outlives this.
  explicit Rig(Backend& other, const ArmModel& model = shipped_lynx5())
      : arm(model), planner(model), backend(model, {}), device(other) {
    restart();
  }

  /// Starts a new real-time task on the state of the previous one. A pressed stop stays pressed.
  void restart(const rt::CycleStart& start = {.position_known = true}) {
    const std::uint32_t pressed = emergency_stop ? emergency_stop->sources() : 0;
    emergency_stop = std::make_unique<EmergencyStop>();
    for (const StopSource source : {StopSource::kGpio, StopSource::kDevice}) {
      emergency_stop->set(source, (pressed & static_cast<std::uint32_t>(source)) != 0);
    }
    cycle = std::make_unique<rt::Cycle>(arm, rt::CycleChannel{*task, stops->count, servants}, device,
                                        *emergency_stop, start, settings);
    cycle->connect({servant.get(), ++session});
    device.open(cycle->frame());
  }

  rt::StepReport step() {
    now_ns += arm.period_ns;
    if (servant_responds) servant->control.servant_beat.fetch_add(1);
    const rt::StepReport report = cycle->step(now_ns, now_ns + 1'000'000'000'000);
    (void)task->snapshot.load(snapshot);
    return report;
  }
  void step(int count) {
    for (int i = 0; i < count; ++i) step();
  }

  /// Fills in number and epoch as the servant does.
  Command stamp(Command command) {
    command.id = servant->next_command_id.fetch_add(1);
    command.epoch = raise_stop_count(servant->control.stop_count, snapshot.stops_done);
    command.incarnation = static_cast<std::uint32_t>(task->incarnation);
    return command;
  }
  bool push(const Command& command) {
    return RingProducer(servant->commands, task->commands_tail).push(command);
  }
  [[nodiscard]] std::size_t queued() const { return ring_size(servant->commands, task->commands_tail); }
  /// Number of the last command pushed.
  std::uint64_t submit(const std::vector<Command>& commands) {
    std::uint64_t id = 0;
    for (const Command& command : commands) {
      const Command stamped = stamp(command);
      id = stamped.id;
      if (!push(stamped)) return 0;
    }
    return id;
  }
  std::uint64_t submit(const PlanResult& plan) { return submit(with_knots(plan)); }
  /// Its commands, the knots in slots of their own: of kKnotSlots paths the last ones.
  std::vector<Command> with_knots(const PlanResult& plan) {
    auto commands = std::get<std::vector<Command>>(plan);
    for (std::size_t i = 0; i < plan.rates.size(); ++i) {
      KnotRange* const range = knots_of(commands[i]);
      if (range == nullptr || range->count == 0) continue;
      range->slot = static_cast<std::uint16_t>(knot_slots++ % kKnotSlots);
      RateSlot& rate = servant->rates[range->slot];
      std::copy(plan.rates[i].knots.begin(), plan.rates[i].knots.end(), rate.knots.begin());
      std::copy(plan.rates[i].pieces.begin(), plan.rates[i].pieces.end(), rate.pieces.begin());
    }
    return commands;
  }

  [[nodiscard]] PlanStart start() const { return {snapshot.position_q, snapshot.gripper}; }
  /// Returns the number of stops that the cycle has carried out.
  [[nodiscard]] std::uint64_t stops_done() const { return snapshot.stops_done - rt::StopRequests::kNone; }
  void stop() {
    (void)raise_stop_count(servant->control.stop_count, snapshot.stops_done);
    servant->control.stop_count.fetch_add(1);
  }
  /// Takes back the commands with these numbers.
  void cancel(std::uint64_t first, std::uint64_t last) {
    CancelRequest request{};
    (void)servant->control.cancel.load(request);
    servant->control.cancel.store({request.count + 1, first, last});
  }
  void pause(bool on) { servant->control.pause.store(on ? 1 : 0); }
  void override_to(double ratio) { servant->control.override_ratio.store(ratio); }
  void clear() { servant->control.clear_count.fetch_add(1); }

  std::optional<Completion> completion() {
    Completion taken{};
    if (RingConsumer(task->completions, servant->completions_tail).pop(taken) != PopResult::kOk)
      return std::nullopt;
    return taken;
  }
  std::optional<AlarmEvent> alarm() {
    AlarmEvent taken{};
    if (RingConsumer(task->alarms, servant->alarms_tail).pop(taken) != PopResult::kOk) return std::nullopt;
    return taken;
  }

  ArmModel arm;
  Planner planner;
  rt::LoopbackBackend backend;
  Backend& device{backend};
  std::unique_ptr<TaskSegment> task = std::make_unique<TaskSegment>();
  std::unique_ptr<ServantSegment> servant = std::make_unique<ServantSegment>();
  std::unique_ptr<StopSegment> stops = std::make_unique<StopSegment>();
  ServantMailbox servants;
  std::uint64_t session{0};
  std::unique_ptr<EmergencyStop> emergency_stop;
  std::unique_ptr<rt::Cycle> cycle;
  rt::CycleSettings settings;
  bool servant_responds{true};
  std::uint64_t knot_slots{0};
  Snapshot snapshot{};
  std::int64_t now_ns{1'000'000'000};
};

}  // namespace corbot::test
