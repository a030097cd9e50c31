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
/// objects each way, heartbeat, emergencies. Without a bus: it is given frames and the time, and its own
/// frames are fetched.
class Cia402Node final : private NodeServices {
 public:
  Cia402Node(std::uint8_t node, const Cia402DriveOptions& options);

  void receive(const can_frame& frame, std::int64_t now_ns);
  /// Lets time pass.
  void advance(std::int64_t now_ns);
  /// What it has sent since the last call.
  [[nodiscard]] std::vector<can_frame> take_sent();
  /// When it next has something to do on its own.
  [[nodiscard]] std::optional<std::int64_t> next_event_ns() const;

  /// Power off and on; the shaft stays. It boots, as it does when it is first advanced.
  void power_cycle(std::int64_t now_ns, bool counts_from_0 = false);
  /// Reports an error; one of a fault class (not 81xxh, 82xxh, FFxxh) also stops the drive. 0: it has gone.
  void emergency(std::uint16_t code, std::int64_t now_ns);
  void set_sto(bool is_on, std::int64_t now_ns);
  /// Something holds the shaft.
  void set_blocked(bool is_on, std::int64_t now_ns);
  /// See Cia402Drive.
  void set_piece(std::optional<std::int32_t> count, std::int64_t now_ns);
  /// It does not follow its targets, see Cia402Drive.
  void set_ignoring(bool is_on, std::int64_t now_ns);
  /// From operation enabled to switch on disabled, unasked.
  void leave_operation(std::int64_t now_ns);
  /// By hand; false: the motor holds the shaft.
  bool turn(double counts, std::int64_t now_ns);
  void set_switches(const AxisSwitches& switches) { drive_.set_switches(switches); }
  /// Has no absolute encoder: after each power-up it counts from 0, and is not homed.
  void set_incremental(bool is_on) { is_incremental_ = is_on; }
  /// The next SDO request, or the next for this object, is answered by this.
  void abort_next(std::uint32_t code, std::optional<ObjectPattern> where = {}) {
    sdo_server_.abort_next(code, where);
  }
  /// What its objects make otherwise than usual; `change` is given the rules.
  template <class Change>
  void change_rules(const Change& change) {
    change(rules_);
    rules_.apply_to(objects_);
  }
  /// Of an object, as its maker's tool stores it; false: there is none, or it does not hold this number.
  bool store(ObjectKey key, std::uint32_t raw, std::int64_t now_ns);

  [[nodiscard]] std::uint8_t node() const { return node_; }
  [[nodiscard]] const Cia402Drive& drive() const { return drive_; }
  /// State of its communication, as a heartbeat tells it (CiA 301): 5 operational, 127 pre-operational, 4 stopped.
  [[nodiscard]] int nmt_state() const { return static_cast<int>(nmt_); }

 private:
  enum class Nmt : std::uint8_t { kBoot = 0, kStopped = 4, kOperational = 5, kPreOperational = 127 };

  void boot(bool counts_from_0 = false);
  void begin_communication();
  void refresh() override;
  [[nodiscard]] std::uint32_t check_state(ObjectKey key) const override;
  [[nodiscard]] bool is_unanswered(ObjectKey key) const override { return rules_.is_unanswered(key); }
  void apply(ObjectKey key, std::int64_t value) override;
  /// What the drive makes of its own objects.
  void hand_over(ObjectKey index);
  void send(canid_t id, std::vector<std::uint8_t> data) override;
  void send_emergency(std::uint16_t code) override;
  /// 1016h and 6007h.
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
  std::int64_t heartbeat_ns_{0};           ///< when the next is due
  std::optional<std::int64_t> master_ns_;  ///< when its heartbeat came; nothing: it is not awaited
  bool has_missed_master_{false};
  std::uint16_t reported_{0};  ///< fault of the drive that an emergency has reported
  SdoServer sdo_server_;
  ProcessData process_data_;
  std::vector<can_frame> sent_;
};

}  // namespace corbot::sim
