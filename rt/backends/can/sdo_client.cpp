// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/sdo_client.h"

#include <algorithm>

#include "corbot/running_time.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;
using Clock = CanPort::Clock;
using Step = SdoTransfer::Step;

constexpr auto kAnswerWithin = 500ms;
constexpr auto kTransferWithin = 2s;  // with all its segments and tries
constexpr auto kSendWithin = 50ms;
constexpr int kMostWaiting = 4096;  // frames, on a bus that never rests
constexpr int kRequestTries = 2;    // a busy node may miss a request

bool is_not_there(const SdoTransfer& transfer) {
  return transfer.abort_code() == SdoTransfer::kNoObject || transfer.abort_code() == SdoTransfer::kNoSubIndex;
}

}  // namespace

void SdoClient::fail(DeviceCause cause, const std::string& what) const {
  throw DeviceError(cause, port_.interface() + ": node " + std::to_string(node_) + ": " + what);
}

void SdoClient::fail_aborted(const SdoTransfer& transfer, const char* doing) const {
  fail(DeviceCause::kBadAnswer,
       doing + (" " + to_string(transfer.object())) + ": " + describe_abort(transfer.abort_code()));
}

bool SdoClient::run(SdoTransfer& transfer) {
  const SdoTransfer unbegun = transfer;
  RunningTime spent(kAnswerWithin, Clock::now());
  for (int tried = 1;; ++tried) {
    // Discards replies queued before the request; they belong to an earlier one.
    for (int i = 0; i < kMostWaiting; ++i) {
      const auto frame = port_.read(Clock::time_point{});
      if (!frame) break;
      watch_.take(*frame, Clock::now());
    }
    port_.write(transfer.request(), Clock::now() + kSendWithin);
    auto deadline = Clock::now() + kAnswerWithin;
    while (const auto frame = port_.read(deadline)) {
      watch_.take(*frame, Clock::now());
      const Step step = transfer.take(*frame);
      if (step == Step::kDone) return true;
      if (step == Step::kAborted) return false;
      if (step == Step::kIgnored) continue;
      port_.write(transfer.request(), Clock::now() + kSendWithin);
      const auto now = Clock::now();
      deadline = now + std::min<Clock::duration>(kAnswerWithin, kTransferWithin - spent.look(now));
      if (step == Step::kProtocol) {
        fail(DeviceCause::kBadAnswer, "invalid reply for " + to_string(transfer.object()) + ": " +
                                          describe_abort(transfer.abort_code()));
      }
    }
    watch_.check_bus();
    transfer.abort(SdoTransfer::kTimedOut);
    port_.write(transfer.request(), Clock::now() + kSendWithin);
    if (spent.look(Clock::now()) >= kTransferWithin) {
      fail(DeviceCause::kNoAnswer, "SDO transfer of " + to_string(transfer.object()) + " timed out");
    }
    if (tried == kRequestTries) {
      fail(DeviceCause::kNoAnswer, "does not answer: is it powered, are its number and the bit rate right?");
    }
    transfer = unbegun;
  }
}

std::uint32_t SdoClient::number_of(const SdoTransfer& transfer) const {
  const auto& data = transfer.data();
  if (data.empty() || data.size() > 4) {
    fail(DeviceCause::kBadAnswer,
         to_string(transfer.object()) + " has " + std::to_string(data.size()) + " bytes");
  }
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < data.size(); ++i) value |= static_cast<std::uint32_t>(data[i]) << (8 * i);
  return value;
}

std::uint32_t SdoClient::read(ObjectAddress object) {
  SdoTransfer transfer = SdoTransfer::upload(node_, object);
  if (!run(transfer)) fail_aborted(transfer, "reading");
  return number_of(transfer);
}

std::optional<std::uint32_t> SdoClient::read_if_there(ObjectAddress object) {
  SdoTransfer transfer = SdoTransfer::upload(node_, object);
  if (run(transfer)) return number_of(transfer);
  if (!is_not_there(transfer)) fail_aborted(transfer, "reading");
  return std::nullopt;
}

std::string SdoClient::read_text(ObjectAddress object) {
  SdoTransfer transfer = SdoTransfer::upload(node_, object);
  if (!run(transfer)) {
    if (!is_not_there(transfer)) fail_aborted(transfer, "reading");
    return "";
  }
  constexpr std::size_t kLongest = 80;
  std::string text;
  for (const std::uint8_t byte : transfer.data()) {
    if (byte == 0 || text.size() == kLongest) break;
    text += byte >= 0x20 && byte < 0x7F ? static_cast<char>(byte) : '?';
  }
  return text;
}

void SdoClient::write(ObjectAddress object, std::uint32_t value, std::size_t bytes) {
  SdoTransfer transfer = SdoTransfer::download(node_, object, value, bytes);
  if (!run(transfer)) fail_aborted(transfer, "writing");
}

std::optional<std::uint32_t> SdoClient::try_to_write(ObjectAddress object, std::uint32_t value,
                                                     std::size_t bytes) {
  SdoTransfer transfer = SdoTransfer::download(node_, object, value, bytes);
  return run(transfer) ? std::nullopt : std::optional(transfer.abort_code());
}

void SdoClient::check(ObjectAddress object, std::uint32_t value, std::size_t bytes, std::uint32_t mask) {
  const auto kept = static_cast<std::uint32_t>(bytes >= 4 ? mask : mask & ((1u << (8 * bytes)) - 1));
  const std::uint32_t found = read(object);
  if ((found & kept) == (value & kept)) return;
  fail(DeviceCause::kBadAnswer, to_string(object) + " was set to " + hex(value, static_cast<int>(2 * bytes)) +
                                    " but is " + hex(found, static_cast<int>(2 * bytes)));
}

}  // namespace corbot::rt
