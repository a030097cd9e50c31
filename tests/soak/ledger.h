// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace corbot::soak {

/// One call of one client, as the client printed it.
struct Call {
  int client{};
  int number{};
  std::string operation;
  std::int64_t signature{};
  std::array<double, 4> where{};  ///< as the client printed it, of a call that moves something
  std::int64_t begin_ns{};
  std::int64_t end_ns{};  ///< 0: no answer, or none that the client lived to print
  std::string outcome;
  std::uint64_t ticket{};

  [[nodiscard]] bool answered() const noexcept { return end_ns != 0; }
  [[nodiscard]] bool accepted() const noexcept { return answered() && outcome == "ok"; }
  [[nodiscard]] bool moves() const noexcept { return operation == "Drive" || operation.starts_with("Start"); }
};

/// What all clients called and were answered.
class Ledger {
 public:
  /// One line of a client. Lines that are no report of a call are ignored.
  void read(int client, const std::string& line);

  [[nodiscard]] const std::vector<Call>& calls() const noexcept { return calls_; }
  /// The newest call with this signature that moves something and had begun by then; null when nobody made one. In a
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
