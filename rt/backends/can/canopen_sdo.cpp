// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/canopen_sdo.h"

#include <algorithm>
#include <array>
#include <utility>

#include "rt/backends/can/canopen.h"

namespace corbot::rt {
namespace {

// Command specifiers: the three high bits of the first byte.
constexpr unsigned kInitiateDownload = 1u << 5;
constexpr unsigned kInitiateUpload = 2u << 5;
constexpr unsigned kUploadSegment = 3u << 5;
constexpr unsigned kAbort = 4u << 5;
constexpr unsigned kAnsweredSegment = 0u << 5;
constexpr unsigned kAnsweredUpload = 2u << 5;
constexpr unsigned kAnsweredDownload = 3u << 5;
constexpr unsigned kSpecifier = 7u << 5;
constexpr unsigned kToggle = 1u << 4;
constexpr unsigned kExpedited = 2;
constexpr unsigned kSizeTold = 1;
constexpr unsigned kLastSegment = 1;
constexpr std::size_t kSegmentBytes = 7;

}  // namespace

SdoTransfer::SdoTransfer(std::uint8_t node, ObjectAddress object, bool is_upload)
    : node_(node), object_(object), is_upload_(is_upload) {
  request_.can_id = kSdoRequest + node;
  request_.can_dlc = CAN_MAX_DLEN;
  request_.data[0] = kInitiateUpload;
  request_.data[1] = static_cast<std::uint8_t>(object.index);
  request_.data[2] = static_cast<std::uint8_t>(object.index >> 8);
  request_.data[3] = object.sub;
}

SdoTransfer SdoTransfer::upload(std::uint8_t node, ObjectAddress object) { return {node, object, true}; }

SdoTransfer SdoTransfer::download(std::uint8_t node, ObjectAddress object, std::uint32_t value,
                                  std::size_t bytes) {
  SdoTransfer transfer(node, object, false);
  const auto unused = static_cast<unsigned>(4 - std::clamp<std::size_t>(bytes, 1, 4));
  transfer.request_.data[0] =
      static_cast<std::uint8_t>(kInitiateDownload | unused << 2 | kExpedited | kSizeTold);
  for (std::size_t i = 0; i < 4 - unused; ++i) {
    transfer.request_.data[4 + i] = static_cast<std::uint8_t>(value >> (8 * i));
  }
  return transfer;
}

void SdoTransfer::abort(std::uint32_t code) {
  abort_code_ = code;
  request_ = SdoTransfer(node_, object_, is_upload_).request_;
  request_.data[0] = kAbort;
  for (std::size_t i = 0; i < 4; ++i) request_.data[4 + i] = static_cast<std::uint8_t>(code >> (8 * i));
}

SdoTransfer::Step SdoTransfer::protocol_error(std::uint32_t code) {
  abort(code);
  return Step::kProtocol;
}

SdoTransfer::Step SdoTransfer::take(const CanFrame& answer) {
  if (answer.can_id != kSdoAnswer + node_) return Step::kIgnored;
  if (answer.can_dlc != CAN_MAX_DLEN) return protocol_error(kUnknownCommand);
  const unsigned specifier = answer.data[0] & kSpecifier;
  const bool names_object = answer.data[1] == (object_.index & 0xFF) &&
                            answer.data[2] == object_.index >> 8 && answer.data[3] == object_.sub;
  if (specifier == kAbort) {
    if (!names_object) return Step::kIgnored;
    abort_code_ = little_endian(answer, 4, 4);
    return Step::kAborted;
  }
  if (in_segments_) return take_segment(answer);
  if (!names_object) return Step::kIgnored;  // a late reply to a request that was given up
  if (is_upload_) return take_upload(answer);
  return specifier == kAnsweredDownload ? Step::kDone : Step::kIgnored;
}

SdoTransfer::Step SdoTransfer::take_upload(const CanFrame& answer) {
  const unsigned command = answer.data[0];
  if ((command & kSpecifier) != kAnsweredUpload) return Step::kIgnored;
  if ((command & kExpedited) != 0) {
    const std::size_t bytes = (command & kSizeTold) != 0 ? 4 - (command >> 2 & 3u) : 4;
    data_.assign(answer.data + 4, answer.data + 4 + bytes);
    return Step::kDone;
  }
  in_segments_ = true;
  ask_segment();
  return Step::kSend;
}

SdoTransfer::Step SdoTransfer::take_segment(const CanFrame& answer) {
  const unsigned command = answer.data[0];
  if ((command & kSpecifier) != kAnsweredSegment) return Step::kIgnored;
  if (((command & kToggle) != 0) != toggle_) return protocol_error(kToggleBit);
  const std::size_t bytes = kSegmentBytes - (command >> 1 & 7u);
  const bool is_last = (command & kLastSegment) != 0;
  if (bytes == 0 && !is_last) return protocol_error(kUnknownCommand);  // it would go on for ever
  if (data_.size() + bytes > kMostBytes) return protocol_error(0x0504'0005);
  data_.insert(data_.end(), answer.data + 1, answer.data + 1 + bytes);
  if (is_last) return Step::kDone;
  toggle_ = !toggle_;
  ask_segment();
  return Step::kSend;
}

void SdoTransfer::ask_segment() {
  std::fill(std::begin(request_.data), std::end(request_.data), std::uint8_t{0});
  request_.data[0] = static_cast<std::uint8_t>(kUploadSegment | (toggle_ ? kToggle : 0));
}

std::string describe_abort(std::uint32_t code) {
  static constexpr std::array<std::pair<std::uint32_t, const char*>, 30> kWords{{
      {0x0503'0000, "toggle bit not alternated"},
      {0x0504'0000, "SDO protocol timed out"},
      {0x0504'0001, "command specifier not valid or unknown"},
      {0x0504'0005, "out of memory"},
      {0x0601'0000, "unsupported access to an object"},
      {0x0601'0001, "attempt to read a write-only object"},
      {0x0601'0002, "attempt to write a read-only object"},
      {0x0602'0000, "object does not exist"},
      {0x0604'0041, "object cannot be mapped to the PDO"},
      {0x0604'0042, "mapped objects exceed the length of a PDO"},
      {0x0604'0043, "parameters are incompatible"},
      {0x0604'0047, "internal incompatibility in the device"},
      {0x0606'0000, "access failed due to a hardware error"},
      {0x0607'0010, "length of the value does not match"},
      {0x0607'0012, "value too long"},
      {0x0607'0013, "value too short"},
      {0x0609'0011, "sub-index does not exist"},
      {0x0609'0030, "value out of range"},
      {0x0609'0031, "value too high"},
      {0x0609'0032, "value too low"},
      {0x0609'0036, "maximum less than minimum"},
      {0x060A'0023, "resource not available"},
      {0x0800'0000, "general error"},
      {0x0800'0020, "value cannot be transferred or stored"},
      {0x0800'0021, "value cannot be transferred because of local control"},
      {0x0800'0022, "value cannot be transferred in the present state of the device"},
      {0x0800'0023, "no object dictionary is present"},
      {0x0800'0024, "no data available"},
      {0x0504'0002, "invalid block size"},
      {0x0504'0003, "invalid sequence number"},
  }};
  const auto* const found =
      std::find_if(kWords.begin(), kWords.end(), [&](const auto& entry) { return entry.first == code; });
  return (found == kWords.end() ? "unknown reason" : found->second) + (" (" + hex(code, 8) + ")");
}

std::string hex(std::uint32_t value, int digits) {
  static constexpr const char* kDigits = "0123456789ABCDEF";
  std::string text = "0x";
  for (int i = digits - 1; i >= 0; --i) text += kDigits[value >> (4 * i) & 0xFu];
  return text;
}

std::string to_string(ObjectAddress object) {
  std::string text = hex(object.index, 4).substr(2) + "h";
  if (object.sub != 0) text += ":" + std::to_string(object.sub);
  return text;
}

}  // namespace corbot::rt
