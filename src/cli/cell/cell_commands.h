// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace CLI {  // NOLINT(readability-identifier-naming): the name of the library
class App;
}

namespace corbot::cli {

/// Adds `corbot cell` with its own commands.
void add_cell(CLI::App& app);

}  // namespace corbot::cli
