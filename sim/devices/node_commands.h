// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sim/devices/cia402_node.h"

namespace corbot::sim {

/// A drive on a bus that is served, with the faults of its connection.
struct ServedNode {
  Cia402Node node;
  bool is_silent{false};
  bool is_mute{false};  ///< sends no process data
  std::int32_t recorded_target{0};
  std::int32_t recorded_position{0};
  bool recorded_power{false};
};

/// Carries out a command for one of `nodes`, or for all of them. Returns the error, which is empty if there
/// is none.
[[nodiscard]] std::string execute_on_nodes(std::vector<ServedNode>& nodes,
                                           std::vector<std::string_view> words, std::int64_t now_ns);

/// Returns the commands with their arguments, in a row.
[[nodiscard]] std::string list_node_commands();
/// Returns the same with a line and an explanation each, for `--help`.
[[nodiscard]] std::string explain_node_commands();

}  // namespace corbot::sim
