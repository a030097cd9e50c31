// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "rt/backends/can/can_port.h"

namespace corbot::rt {

/// An entry of a node's object dictionary.
struct ObjectAddress {
  std::uint16_t index;
  std::uint8_t sub{0};
};

/// One transfer by SDO (CiA 301, 7.2.4) as a state machine without a bus. It writes values of up to four
/// bytes, and reads values of up to kMostBytes. It does not trust the server's frames.
class SdoTransfer {
 public:
  static constexpr std::size_t kMostBytes = 1024;
  static constexpr std::uint32_t kToggleBit = 0x0503'0000;
  static constexpr std::uint32_t kTimedOut = 0x0504'0000;
  static constexpr std::uint32_t kUnknownCommand = 0x0504'0001;
  static constexpr std::uint32_t kNoObject = 0x0602'0000;
  static constexpr std::uint32_t kNoSubIndex = 0x0609'0011;

  enum class Step {
    kIgnored,  ///< of another transfer, or a late reply of a node that was queried twice
    kSend,     ///< continue with request()
    kDone,
    kAborted,   ///< by the server, see abort_code()
    kProtocol,  ///< the server broke the rules; request() is the abort to send to it
  };

  [[nodiscard]] static SdoTransfer upload(std::uint8_t node, ObjectAddress object);
  /// `bytes` of `value`, 1 to 4, least significant first.
  [[nodiscard]] static SdoTransfer download(std::uint8_t node, ObjectAddress object, std::uint32_t value,
                                            std::size_t bytes);

  /// Returns the frame to be sent now.
  [[nodiscard]] const CanFrame& request() const noexcept { return request_; }
  Step take(const CanFrame& answer);
  /// Aborts the transfer; request() is then the abort for the server.
  void abort(std::uint32_t code);

  [[nodiscard]] ObjectAddress object() const noexcept { return object_; }
  [[nodiscard]] std::uint32_t abort_code() const noexcept { return abort_code_; }
  [[nodiscard]] const std::vector<std::uint8_t>& data() const noexcept { return data_; }

 private:
  SdoTransfer(std::uint8_t node, ObjectAddress object, bool is_upload);
  Step protocol_error(std::uint32_t code);
  Step take_upload(const CanFrame& answer);
  Step take_segment(const CanFrame& answer);
  void ask_segment();

  std::uint8_t node_;
  ObjectAddress object_;
  bool is_upload_;
  bool in_segments_{false};
  bool toggle_{false};
  CanFrame request_{};
  std::vector<std::uint8_t> data_;
  std::uint32_t abort_code_{0};
};

/// Describes an abort code by CiA 301, table 22.
[[nodiscard]] std::string describe_abort(std::uint32_t code);
/// Returns "6060h" or "1018h:1".
[[nodiscard]] std::string to_string(ObjectAddress object);
/// Returns "0x" and the given number of digits.
[[nodiscard]] std::string hex(std::uint32_t value, int digits);

}  // namespace corbot::rt
