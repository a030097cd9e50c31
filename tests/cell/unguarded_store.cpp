// SPDX-License-Identifier: Apache-2.0
// The store without the check of zones, for the test that shows that the scene reports a touch. Every robot enters at once.
#include "cell/orb_server.h"
#include "cell/program.h"
#include "cell/store/store_servant.h"

namespace corbot::cell {
namespace {

void run(const CellConfig& cell) {
  Ledger ledger(cell, ZoneCheck::kOff);
  StoreServant servant(ledger);
  OrbServer server(cell.host, cell.store_port());
  server.activate(kStoreKey, &servant);
  server.serve(kStoreKey);
  ledger.end_waiting();
}

}  // namespace
}  // namespace corbot::cell

int main(int argc, char** argv) {
  return corbot::cell::run_program(
      argc, argv,
      {.name = "unguarded_store", .about = "A store without the check of zones", .run = corbot::cell::run});
}
