// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace corbot::soak {

/// Client number of the calls that the soak itself makes (`corbot stop` on the robot's machine).
inline constexpr int kByCommand = 0;
inline constexpr const char* kLocalStop = "corbot-stop";

/// These clients come through the relay, whose connections are cut and fall silent.
constexpr bool is_relayed(int client) noexcept { return client % 2 == 1; }

/// One call of one client, as the client printed it.
struct Call {
  int client{};
  int number{};
  std::string operation;
  std::int64_t signature{};  ///< of a Wait or Cancel: the ticket
  int key{};                 ///< number of the Acquire through whose reference it was made; 0: the public one
  std::array<double, 9> where{};  ///< as the client printed it: a target, a lease, a time to wait
  std::int64_t begin_ns{};
  std::int64_t end_ns{};  ///< 0: no answer, or none that the client lived to print
  std::string outcome;
  std::uint64_t ticket{};

  [[nodiscard]] bool answered() const noexcept { return end_ns != 0; }
  [[nodiscard]] bool accepted() const noexcept { return answered() && outcome == "ok"; }
  /// Returns when its motion has ended.
  [[nodiscard]] bool waits_for_motion() const noexcept {
    return operation == "Drive" || operation == "MoveS" || operation == "MoveC";
  }
  [[nodiscard]] bool moves() const noexcept { return waits_for_motion() || operation.starts_with("Start"); }
  [[nodiscard]] bool is_line() const noexcept { return operation.ends_with("MoveS"); }
  [[nodiscard]] bool is_arc() const noexcept { return operation.ends_with("MoveC"); }
  /// Returns when the arm has stopped, and what had been accepted has ended.
  [[nodiscard]] bool stops() const noexcept {
    return operation == "Stop" || operation == "StopAndHold" || operation == "Release" ||
           operation == kLocalStop;
  }
  /// Returns true for calls that only the holder of exclusive control may make.
  [[nodiscard]] bool needs_control() const noexcept {
    return moves() || operation == "Pause" || operation == "Resume" || operation == "Cancel" ||
           operation == "Renew" || operation == "Release";
  }
};

/// The calls of all clients and their outcomes.
class Ledger {
 public:
  /// One line of a client. Lines that are no report of a call are ignored.
  void read(int client, const std::string& line);

  [[nodiscard]] const std::vector<Call>& calls() const noexcept { return calls_; }
  /// Returns the newest motion call with this signature that had begun by then; null when there is none. In a
  /// long run signatures come round again.
  [[nodiscard]] const Call* with_signature(std::int64_t signature, std::int64_t by_ns) const;
  /// Has this client a call without an answer? Since when, CLOCK_MONOTONIC.
  [[nodiscard]] std::optional<std::int64_t> waiting_since(int client) const;

 private:
  std::vector<Call> calls_;
  std::map<std::pair<int, int>, std::size_t> index_;
  std::multimap<std::int64_t, std::size_t> by_signature_;
  std::map<int, std::size_t> newest_;
};

}  // namespace corbot::soak
