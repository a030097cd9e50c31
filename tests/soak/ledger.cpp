// SPDX-License-Identifier: Apache-2.0
#include "soak/ledger.h"

#include <sstream>

namespace corbot::soak {

void Ledger::read(int client, const std::string& line) {
  std::istringstream words(line);
  std::string what;
  Call call;
  call.client = client;
  std::int64_t time_ns = 0;
  if (!(words >> what >> call.number >> time_ns)) return;
  if (what == "begin" && words >> call.operation >> call.signature >> call.key) {
    call.begin_ns = time_ns;
    for (double& value : call.where) words >> value;
    index_[{client, call.number}] = calls_.size();
    newest_[client] = calls_.size();
    if (call.moves()) by_signature_.emplace(call.signature, calls_.size());
    calls_.push_back(std::move(call));
  } else if (what == "end" && words >> call.outcome >> call.ticket) {
    const auto found = index_.find({client, call.number});
    if (found == index_.end()) return;
    Call& begun = calls_[found->second];
    begun.end_ns = time_ns;
    begun.outcome = call.outcome;
    begun.ticket = call.ticket;
  }
}

const Call* Ledger::with_signature(std::int64_t signature, std::int64_t by_ns) const {
  const Call* newest = nullptr;
  const auto [first, last] = by_signature_.equal_range(signature);
  for (auto found = first; found != last; ++found) {
    const Call& call = calls_[found->second];
    if (call.begin_ns <= by_ns && (newest == nullptr || call.begin_ns > newest->begin_ns)) newest = &call;
  }
  return newest;
}

std::optional<std::int64_t> Ledger::waiting_since(int client) const {
  const auto found = newest_.find(client);
  if (found == newest_.end() || calls_[found->second].answered()) return std::nullopt;
  return calls_[found->second].begin_ns;
}

}  // namespace corbot::soak
