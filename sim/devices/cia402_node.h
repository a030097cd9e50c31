// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "sim/devices/can_objects.h"
#include "sim/devices/cia402_drive.h"
#include "sim/devices/object_rules.h"
#include "sim/devices/process_data.h"
#include "sim/devices/sdo_server.h"

namespace corbot::sim {

/// A drive as a CANopen node (CiA 301): network management, object dictionary by SDO, four process data
/// objects each way, heartbeat, emergencies. It has no bus: the caller gives it frames and the time, and
/// fetches its own frames.
class Cia402Node final : private NodeServices {
 public:
  Cia402Node(std::uint8_t node, const Cia402DriveOptions& options);

  void receive(const can_frame& frame, std::int64_t now_ns);
  /// Lets time pass.
  void advance(std::int64_t now_ns);
  /// Returns the frames that it has sent since the last call.
  [[nodiscard]] std::vector<can_frame> take_sent();
  /// Returns the time of its next action of its own.
  [[nodiscard]] std::optional<std::int64_t> next_event_ns() const;

  /// Switches the power off and on; the shaft stays. The node boots, as it does when it is first advanced.
  void power_cycle(std::int64_t now_ns, bool counts_from_0 = false);
  /// Reports an error; 0: it has gone. An error of a fault class (not 81xxh, 82xxh, FFxxh) also stops the
  /// drive.
  void emergency(std::uint16_t code, std::int64_t now_ns);
  void set_sto(bool is_on, std::int64_t now_ns);
  /// Blocks the shaft.
  void set_blocked(bool is_on, std::int64_t now_ns);
  /// Puts a piece in the shaft's way, see Cia402Drive.
  void set_piece(std::optional<std::int32_t> count, std::int64_t now_ns);
  /// Makes the drive ignore its targets, see Cia402Drive.
  void set_ignoring(bool is_on, std::int64_t now_ns);
  /// Changes from operation enabled to switch on disabled, without a command.
  void leave_operation(std::int64_t now_ns);
  /// Turns the shaft by hand; false: the motor holds the shaft.
  bool turn(double counts, std::int64_t now_ns);
  void set_switches(const AxisSwitches& switches) { drive_.set_switches(switches); }
  /// Removes the absolute encoder: after each power-up it counts from 0, and is not homed.
  void set_incremental(bool is_on) { is_incremental_ = is_on; }
  /// Answers the next SDO request, or the next one for this object, with this abort code.
  void abort_next(std::uint32_t code, std::optional<ObjectPattern> where = {}) {
    sdo_server_.abort_next(code, where);
  }
  /// Changes the rules by which its objects differ from usual ones; `change` gets the rules.
  template <class Change>
  void change_rules(const Change& change) {
    change(rules_);
    rules_.apply_to(objects_);
  }
  /// Stores an object's value, as its maker's tool does; false: there is none, or it does not hold this
  /// number.
  bool store(ObjectKey key, std::uint32_t raw, std::int64_t now_ns);

  [[nodiscard]] std::uint8_t node() const { return node_; }
  [[nodiscard]] const Cia402Drive& drive() const { return drive_; }
  /// Returns the state of its communication, as in a heartbeat (CiA 301): 5 operational, 127 pre-operational,
  /// 4 stopped.
  [[nodiscard]] int nmt_state() const { return static_cast<int>(nmt_); }

 private:
  enum class Nmt : std::uint8_t { kBoot = 0, kStopped = 4, kOperational = 5, kPreOperational = 127 };

  void boot(bool counts_from_0 = false);
  void begin_communication();
  void refresh() override;
  [[nodiscard]] std::uint32_t check_state(ObjectKey key) const override;
  [[nodiscard]] bool is_unanswered(ObjectKey key) const override { return rules_.is_unanswered(key); }
  void apply(ObjectKey key, std::int64_t value) override;
  /// Passes an object of the drive to the drive.
  void hand_over(ObjectKey index);
  void send(canid_t id, std::vector<std::uint8_t> data) override;
  void send_emergency(std::uint16_t code) override;
  /// Handles the master's heartbeat, 1016h and 6007h.
  void receive_master_heartbeat(const can_frame& frame);
  void watch_master();
  [[nodiscard]] std::optional<std::int64_t> master_due_ns() const;
  void report_new_fault();

  void command(const can_frame& frame);
  void send_changed_tpdos();

  std::uint8_t node_;
  CanObjects objects_;
  ObjectRules rules_;
  bool is_incremental_{false};
  Cia402Drive drive_;
  Nmt nmt_{Nmt::kBoot};
  std::int64_t now_ns_{0};
  std::int64_t heartbeat_ns_{0};           ///< time when the next is due
  std::optional<std::int64_t> master_ns_;  ///< time of the master's last heartbeat; empty: it is not awaited
  bool has_missed_master_{false};
  std::uint16_t reported_{0};  ///< fault of the drive that an emergency has reported
  SdoServer sdo_server_;
  ProcessData process_data_;
  std::vector<can_frame> sent_;
};

}  // namespace corbot::sim
