// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/devices/node_services.h"

namespace corbot::sim {

/// The process data objects of an emulated node, four each way (CiA 301, 7.2.2), as its dictionary maps them.
class ProcessData {
 public:
  static constexpr std::size_t kPdos = 4;
  static constexpr std::size_t kMostEntries = 8;

  /// Checks a write to a PDO's objects by CiA 301, 7.5.2.35 to 7.5.2.38. Returns the abort code; 0: no
  /// objection.
  [[nodiscard]] static std::uint32_t check_write(const CanObjects& objects, ObjectKey key,
                                                 std::int64_t value);

  /// Starts when the node becomes operational: every TPDO counts as not sent yet.
  void start();
  /// Drops the RPDOs that wait for a SYNC.
  void drop_received() { received_ = {}; }
  void synchronise(const CanObjects& objects, NodeServices& services);
  /// Takes a frame that may be one of the RPDOs.
  void receive(const can_frame& frame, const CanObjects& objects, NodeServices& services);
  /// Sends the TPDOs that are sent on change.
  void send_changed(const CanObjects& objects, NodeServices& services);

 private:
  void apply_rpdo(std::size_t number, const CanObjects& objects, NodeServices& services);
  void send_tpdo(std::size_t number, const CanObjects& objects, NodeServices& services);

  std::array<std::optional<can_frame>, kPdos> received_{};    ///< until the next SYNC
  std::array<std::vector<std::uint8_t>, kPdos> last_sent_{};  ///< the TPDOs
  std::array<unsigned, kPdos> syncs_{};                       ///< number since the last TPDO
};

}  // namespace corbot::sim
