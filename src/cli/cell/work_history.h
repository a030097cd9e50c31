// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cell/activity.h"

namespace corbot::cli {

/// A step of the ledger that reports show.
enum class Milestone { kReserved, kHeld, kPlaced };

struct PieceMilestone {
  double time_s{};  ///< since the Unix epoch, by the store's clock
  std::string robot;
  std::uint64_t piece{};
  Milestone milestone{};
  bool is_last{false};  ///< placed where no robot takes
};

/// The work of one run, for reports.
struct WorkHistory {
  std::vector<std::string> robots;               ///< in the cell's order
  std::vector<cell::ActivityChange> activities;  ///< by time; empty if the coordinator runs elsewhere
  std::vector<PieceMilestone> milestones;        ///< by time
};

/// A period in seconds since the Unix epoch.
struct Period {
  double begin_s{};
  double end_s{};
  [[nodiscard]] double duration_s() const { return end_s - begin_s; }
};

/// Returns the period from the first piece reserved to the last one placed, or nothing if none was placed.
[[nodiscard]] std::optional<Period> period_of(const WorkHistory& history);

/// One robot's activity, cut at the ends of the period.
struct Span {
  Period period;
  cell::Activity activity{};
  std::uint64_t piece{};
  std::string zone;
};

/// Returns the spans in order, without gaps from the robot's first change on.
[[nodiscard]] std::vector<Span> spans_of(const WorkHistory& history, const std::string& robot,
                                         const Period& period);

/// Returns zone -> robot -> share of the period that the robot spent in it, 0 to 1. Contains only zones that
/// a robot entered.
[[nodiscard]] std::map<std::string, std::map<std::string, double>> zone_shares(const WorkHistory& history,
                                                                               const Period& period);

}  // namespace corbot::cli
