// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <optional>
#include <string>

#include "sim/devices/node_services.h"
#include "sim/devices/object_rules.h"

namespace corbot::sim {

/// The SDO server of an emulated node (CiA 301, 7.2.4): expedited transfers, and uploads in segments.
class SdoServer {
 public:
  explicit SdoServer(std::uint8_t node) : node_(node) {}

  /// Forgets the transfer in progress.
  void reset() { is_uploading_ = false; }
  /// Answers the next request, or the next one for this object, with this abort code.
  void abort_next(std::uint32_t code, std::optional<ObjectPattern> where) { abort_next_ = {code, where}; }
  /// Handles a request to this node; `services` send the answer.
  void handle(const can_frame& frame, const CanObjects& objects, NodeServices& services);

 private:
  void upload(ObjectKey key, const CanObjects& objects, NodeServices& services);
  void upload_segment(unsigned command, NodeServices& services);
  void download(const can_frame& frame, ObjectKey key, const CanObjects& objects, NodeServices& services);
  void answer(unsigned command, ObjectKey key, std::uint32_t value, NodeServices& services) const;
  void abort(ObjectKey key, std::uint32_t code, NodeServices& services);

  std::uint8_t node_;
  struct Abort {
    std::uint32_t code;
    std::optional<ObjectPattern> where;
  };
  std::optional<Abort> abort_next_;
  std::string upload_;  ///< a text that is read in segments
  std::size_t uploaded_{0};
  bool is_uploading_{false};
  bool toggle_{false};
};

}  // namespace corbot::sim
