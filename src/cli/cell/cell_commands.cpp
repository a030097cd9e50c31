// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_commands.h"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <functional>
#include <limits>
#include <memory>
#include <thread>

#include "cell/wall_clock.h"
#include "cli/cell/cell_check.h"
#include "cli/cell/cell_client.h"
#include "cli/cell/cell_directory.h"
#include "cli/cell/cell_processes.h"
#include "cli/cell/cell_run.h"
#include "cli/cell/cell_status.h"
#include "cli/cell/cell_up.h"
#include "client/explain.h"
#include "client/failure.h"
#include "client/number_within.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

namespace {

constexpr int kMostNumber = std::numeric_limits<int>::max();  ///< of a piece, and of a slot

/// The arguments of one command.
struct Words {
  cell::CellOptions cell;
  Corbot::PieceNumber piece{};
  std::string place;  ///< or robot
  int slot{-1};
  bool is_gone{false};
  double interval_s{1};
  int count{0};
};

/// Returns the user's name for the ledger's history.
std::string user_name() {
  const passwd* const user = ::getpwuid(::geteuid());
  return client::printable(user != nullptr ? user->pw_name : fmt::format("uid {}", ::geteuid()))
      .substr(0, 64);
}

/// Shows the coordinator's part even if the store does not run, as it says why the robots wait.
void show(CellClient& client, const cell::CellConfig& cell) {
  CellView view;
  view.name = cell.name;
  for (const cell::Place& place : cell.places) {
    if (cell.is_last(place)) view.last_places.push_back(place.name);
  }
  view.is_paused = client.is_paused();
  view.state = client.state().in();
  try {
    view.places = client.places().in();
    view.unclear = client.unclear().in();
  } catch (const Failure& why) {
    view.store_fault =
        fmt::format("{}; {}", why.what(),
                    cell.store_reference.empty() ? "its log is " + log_file(cell, "store").string()
                                                 : "look at " + cell.store_reference);
  }
  view.now_s = cell::now_s();
  fmt::print("{}", status_text(view));
  std::fflush(stdout);
}

void watch(CellClient& client, const Words& words, const cell::CellConfig& cell) {
  for (int shown = 1;; ++shown) {
    show(client, cell);
    if (shown == words.count) return;
    std::this_thread::sleep_for(std::chrono::duration<double>(words.interval_s));
    fmt::print("\n");
  }
}

void resolve(CellClient& client, const Words& words) {
  if (words.is_gone == !words.place.empty())
    throw Failure(ExitCode::kUsage,
                  "say where the piece stands, by PLACE and SLOT, or that it was taken away, by --gone");
  client.resolve(words.piece, words.place, words.slot, user_name());
}

void release(CellClient& client, const Words& words) {
  const std::string holder = client.release(words.place, user_name());
  fmt::print("{}\n", holder.empty() ? words.place + " was not claimed"
                                    : fmt::format("the claim of '{}' has ended", holder));
}

using Use = std::function<void(CellClient&, const Words&)>;

/// Adds a command for a running cell.
std::pair<CLI::App*, std::shared_ptr<Words>> add_client(CLI::App& cell, const char* name, const char* about,
                                                        Use use) {
  CLI::App* command = cell.add_subcommand(name, about);
  const auto words = std::make_shared<Words>();
  words->cell.add_address_to(*command);
  command->callback([words, use = std::move(use)] {
    const cell::CellConfig config = load_for_command(words->cell);
    CellClient client(config);
    client.expect_running();
    use(client, *words);
  });
  return {command, words};
}

void add_words_of_persons(CLI::App& cell) {
  auto [resolving, piece] = add_client(cell, "resolve", "Record where an unclear piece stands", resolve);
  resolving->add_option("PIECE", piece->piece, "Number of the piece, as 'corbot cell status' shows it")
      ->required()
      ->check(client::whole_number_within(1, kMostNumber))
      ->type_name("NUMBER");
  resolving->add_option("PLACE", piece->place, "Place where the piece stands")->type_name("");
  resolving->add_option("SLOT", piece->slot, "Slot of PLACE, from 0; an area has none")
      ->check(client::whole_number_within(0, kMostNumber))
      ->type_name("NUMBER");
  resolving->add_flag("--gone", piece->is_gone, "The piece was taken away");
  auto [exchanging, emptied] =
      add_client(cell, "exchange", "Record that a place was emptied",
                 [](CellClient& client, const Words& words) { client.exchange(words.place, user_name()); });
  exchanging->add_option("PLACE", emptied->place, "The emptied place; no robot may be at work there")
      ->required()
      ->type_name("");
  auto [releasing, claimed] = add_client(
      cell, "release",
      "End the claim on a robot whose coordinator has ended for good and cannot move the robot any more",
      release);
  releasing->add_option("ROBOT", claimed->place, "Name of the robot in CELL")->required()->type_name("");
}

}  // namespace

void add_cell(CLI::App& app) {
  CLI::App* cell = app.add_subcommand("cell", "A pick-and-place cell: robots, camera, store, coordinator");
  cell->require_subcommand(1);
  CLI::App* run =
      cell->add_subcommand("run", "Start a cell, supervise it until its work is done, and end it");
  const auto options = std::make_shared<CellRunOptions>();
  options->cell.add_to(*run);
  run->add_option("--pictures", options->pictures,
                  "Directory for pictures of the run: cell.svg, gantt.svg, camera.jpg")
      ->type_name("DIRECTORY");
  add_panel_to(*run, options->panel);
  run->add_flag("--until-eof", options->until_eof,
                "End the cell at the end of standard input, such as a pipe from the program that starts it");
  run->footer("Ctrl-C stops the arms and ends everything. docs/cell.md describes CELL.");
  run->callback([options] { cell_run(*options); });

  CLI::App* check =
      cell->add_subcommand("check", "Check whether the robots reach all points of a cell; nothing moves");
  const auto checked = std::make_shared<cell::CellOptions>();
  checked->add_file_to(*check);
  check->callback([checked] { cell_check(*checked); });
  CLI::App* up =
      cell->add_subcommand("up", "Start a cell that stays, and restart each program of it that ends");
  const auto stays = std::make_shared<cell::CellOptions>();
  stays->add_to(*up);
  const auto panel = std::make_shared<PanelPort>();
  add_panel_to(*up, *panel);
  up->callback([stays, panel] { cell_up(*stays, *panel); });
  CLI::App* down = cell->add_subcommand("down", "End a cell that is up, and wait for its end");
  const auto ends = std::make_shared<cell::CellOptions>();
  ends->add_address_to(*down);
  down->callback([ends] { cell_down(*ends); });

  const auto cell_of = [](const Words& words) { return load_for_command(words.cell); };
  add_client(*cell, "status", "Show robots, pieces, zones, and what needs a person",
             [=](CellClient& client, const Words& words) { show(client, cell_of(words)); });
  auto [watching, words] =
      add_client(*cell, "watch", "Show the status of a cell repeatedly",
                 [=](CellClient& client, const Words& given) { watch(client, given, cell_of(given)); });
  watching->add_option("--interval", words->interval_s, "Seconds between two outputs (1)")
      ->check(client::number_within(0.1, 3600.0))
      ->type_name("SECONDS");
  watching->add_option("--count", words->count, "End after so many outputs; 0: go on until Ctrl-C")
      ->check(client::whole_number_within(0, 1'000'000))
      ->type_name("NUMBER");
  add_client(*cell, "start", "Begin the work, or go on after a pause, a stop or a fault that needed a person",
             [](CellClient& client, const Words&) { client.start(); });
  add_client(*cell, "pause", "Let each robot end its motion under way, and begin no other",
             [](CellClient& client, const Words&) { client.pause(); });
  add_client(*cell, "stop", "Stop the arms on their path, and wait until they are at rest",
             [](CellClient& client, const Words&) { client.stop(); });
  add_words_of_persons(*cell);
}

}  // namespace corbot::cli
