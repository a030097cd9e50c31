// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/status_report.h"
#include "client/client.h"
#include "client/stop_on_signal.h"

namespace corbot::cli {

[[nodiscard]] StatusReport read_status(client::Client& client);
[[nodiscard]] std::string status_text(const StatusReport& report);
/// Returns one line, for `watch` without a terminal.
[[nodiscard]] std::string status_line(const StatusReport& report);
[[nodiscard]] std::string status_json(const StatusReport& report);

[[nodiscard]] std::string alarms_text(const Corbot::AlarmList& alarms);
[[nodiscard]] std::string alarms_json(const Corbot::AlarmList& alarms);
[[nodiscard]] std::string diagnostics_text(const Corbot::LoopInfo& info, const Corbot::DeviceInfo& device);
[[nodiscard]] std::string diagnostics_json(const Corbot::LoopInfo& info, const Corbot::DeviceInfo& device);

/// Returns the latency below which the share `ratio` of the wake-ups lies, by the histogram, in seconds. The
/// result is the upper edge of the bucket, so it never flatters. For the last, open bucket it is the maximum.
[[nodiscard]] double latency_quantile(const Corbot::LoopInfo& info, double ratio);

/// Shows the status every `interval_s` until a signal, or `count` times (0 = no end). A terminal is redrawn;
/// other outputs get a line each time.
void watch(client::Client& client, const client::OnSignal& on_signal, double interval_s, int count);

}  // namespace corbot::cli
