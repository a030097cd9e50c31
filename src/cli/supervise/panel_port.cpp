// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/panel_port.h"

#include <CLI/CLI.hpp>
#include <string>

#include "client/number_within.h"

namespace corbot::cli {
namespace {

constexpr int kPanelPort = 8080;

}  // namespace

void add_panel_to(CLI::App& command, PanelPort& port) {
  CLI::Option* const option = command.add_option(
      "--panel", "Start a panel, too, on this port of the loopback (8080); 0: any free one");
  option->expected(0, 1)->check(client::whole_number_within(0, 65535))->type_name("PORT");
  command.parse_complete_callback([option, &port] {
    if (option->count() == 0) return;
    const std::string word = option->results().front();
    port = word.find_first_of("0123456789") == std::string::npos ? kPanelPort : std::stoi(word);
  });
}

}  // namespace corbot::cli
