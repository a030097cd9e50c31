// SPDX-License-Identifier: Apache-2.0
// corbot-camera serves the object Camera of a cell. With --drive it also does the work of one robot, so that
// no coordinator process is necessary.
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cell/camera/camera_servant.h"
#include "cell/camera/picture_view.h"
#include "cell/coordinator/coordinator_servant.h"
#include "cell/orb_server.h"
#include "cell/program.h"
#include "cell/store/store_servant.h"
#include "client/failure.h"
#include "corbot/standard_streams.h"

namespace corbot::cell {
namespace {

struct Drive {
  std::optional<std::string> robot{};  ///< robot whose work the process does; nothing: none
  bool has_own_store{false};           ///< the ledger is in this process's memory
};

void check(const CellConfig& cell, const Drive& drive) {
  if (drive.robot) check_robot(cell, "--drive", *drive.robot);
  if (drive.has_own_store && !cell.store_reference.empty())
    throw client::Failure(
        client::ExitCode::kUsage,
        "--no-store: the cell's store runs elsewhere, as store.reference says: leave out option or key");
}

/// Returns the ports of the objects that this process serves, the camera's first.
std::vector<int> ports(const CellConfig& cell, const Drive& drive) {
  std::vector<int> all{cell.camera_port()};
  if (drive.robot && cell.coordinator_reference.empty()) all.push_back(cell.coordinator_port());
  if (drive.has_own_store) all.push_back(cell.store_port());
  return all;
}

/// Serves the objects until a signal. The robot's worker calls camera and store by the cell's references,
/// even if they are in this process: the ORB then calls the objects directly.
void run(const CellConfig& cell, const Drive& drive) {
  check(cell, drive);
  CameraServant camera(cell);
  std::optional<Ledger> ledger;
  std::optional<StoreServant> store;
  std::optional<CoordinatorServant> coordinator;  // servants outlive the ORB
  OrbServer server(cell.host, ports(cell, drive), kMostJpegBytes + 4096);
  server.activate(kCameraKey, &camera);
  if (drive.has_own_store) {
    CellConfig in_memory = cell;
    in_memory.ledger = kInMemory;
    store.emplace(ledger.emplace(std::move(in_memory)));
    server.activate(kStoreKey, &*store);
  }
  if (drive.robot) {
    coordinator.emplace(server.orb(), cell, std::vector{*drive.robot});
    server.activate(kCoordinatorKey, &*coordinator);
    coordinator->start_unless_stopped();
  }
  server.serve(kCameraKey);
  if (coordinator) coordinator->end();
  if (ledger) ledger->end_waiting();  // the ORB's shutdown waits for calls
}

}  // namespace
}  // namespace corbot::cell

int main(int argc, char** argv) {
  using namespace corbot::cell;
  Drive drive;
  const auto add_options = [&](CLI::App& app) {
    CLI::Option* const robot = app.add_option(
        "--drive", drive.robot, "name of a robot whose work this program does, without a coordinator");
    app.add_flag("--no-store", drive.has_own_store,
                 "keep the ledger in this program, in place of the cell's store: it ends with the program")
        ->needs(robot);
  };
  return run_program(argc, argv,
                     {"corbot-camera", "Takes pictures of a cell and finds the pieces in them.", add_options,
                      [&](const CellConfig& cell) { run(cell, drive); }});
}
