// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace CLI {  // NOLINT(readability-identifier-naming): the name of the library
class App;
}

namespace corbot::cli {

/// The port of a panel on the loopback; 0: any free one, nothing: no panel.
using PanelPort = std::optional<int>;
/// Adds the option --panel.
void add_panel_to(CLI::App& command, PanelPort& port);

}  // namespace corbot::cli
