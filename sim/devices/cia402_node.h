// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/devices/can_objects.h"
#include "sim/devices/cia402_drive.h"

namespace corbot::sim {

/// A drive as a CANopen node (CiA 301): network management, object dictionary by SDO, four process data
/// objects each way, heartbeat, emergencies. Without a bus: it is given frames and the time, and its own
/// frames are fetched.
class Cia402Node {
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
  /// The next SDO request is answered by this.
  void abort_next(std::uint32_t code) { abort_next_ = code; }

  [[nodiscard]] std::uint8_t node() const { return node_; }
  [[nodiscard]] const Cia402Drive& drive() const { return drive_; }

 private:
  static constexpr std::size_t kPdos = 4;
  static constexpr std::size_t kMostEntries = 8;
  enum class Nmt : std::uint8_t { kBoot = 0, kStopped = 4, kOperational = 5, kPreOperational = 127 };

  void add_objects();
  /// 1000h to 1FFFh, as they are after power-up.
  void add_communication_objects();
  void add_pdo(std::size_t number);
  void boot(bool counts_from_0 = false);
  void begin_communication();
  void send(canid_t id, std::vector<std::uint8_t> data);
  void send_emergency(std::uint16_t code);
  /// 1016h and 6007h.
  void hear_master(const can_frame& frame);
  void watch_master();
  [[nodiscard]] std::optional<std::int64_t> master_due_ns() const;
  void report_new_fault();

  void command(const can_frame& frame);
  void serve_sdo(const can_frame& frame);
  void serve_upload(ObjectKey key);
  void serve_segment(unsigned command);
  void serve_download(const can_frame& frame, ObjectKey key);
  void answer_sdo(unsigned command, ObjectKey key, std::uint32_t value);
  void abort_sdo(ObjectKey key, std::uint32_t code);

  /// The rules of CiA 301, 7.5.2.35 to 7.5.2.38, for what concerns PDOs; 0: no objection.
  [[nodiscard]] std::uint32_t check_pdo_write(ObjectKey key, std::int64_t value) const;
  [[nodiscard]] std::uint32_t check_mapping_count(ObjectKey mapping, bool is_received,
                                                  std::int64_t count) const;
  void apply(ObjectKey key, std::int64_t value);
  void refresh();

  void synchronise();
  void take_rpdo(std::size_t number, const can_frame& frame);
  void apply_rpdo(std::size_t number);
  void send_tpdo(std::size_t number);
  [[nodiscard]] std::vector<std::uint8_t> tpdo_data(std::size_t number) const;
  void send_changed_tpdos();

  std::uint8_t node_;
  CanObjects objects_;
  Cia402Drive drive_;
  Nmt nmt_{Nmt::kBoot};
  std::int64_t now_ns_{0};
  std::int64_t heartbeat_ns_{0};           ///< when the next is due
  std::optional<std::int64_t> master_ns_;  ///< when its heartbeat came; nothing: it is not awaited
  bool has_missed_master_{false};
  std::uint16_t reported_{0};  ///< fault of the drive that an emergency has told
  std::optional<std::uint32_t> abort_next_;
  std::string upload_;  ///< a text that is read in segments
  std::size_t uploaded_{0};
  bool is_uploading_{false};
  bool toggle_{false};
  std::array<std::optional<can_frame>, kPdos> received_{};    ///< until the next SYNC
  std::array<std::vector<std::uint8_t>, kPdos> last_sent_{};  ///< TPDOs
  std::array<unsigned, kPdos> syncs_{};                       ///< since the last TPDO
  std::vector<can_frame> sent_;
};

}  // namespace corbot::sim
