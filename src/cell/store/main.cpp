// SPDX-License-Identifier: Apache-2.0
// corbot-store serves the ledger of a cell's pieces as the object Store.
#include "cell/orb_server.h"
#include "cell/program.h"
#include "cell/store/store_servant.h"
#include "corbot/standard_streams.h"

namespace corbot::cell {
namespace {

void keep_ledger(const CellConfig& cell) {
  Ledger ledger(cell);
  StoreServant servant(ledger);
  OrbServer server(cell.host, {cell.store_port()});
  server.activate(kStoreKey, &servant);
  server.serve(kStoreKey);
  ledger.end_waiting();  // the ORB's shutdown waits for calls
}

}  // namespace
}  // namespace corbot::cell

int main(int argc, char** argv) {
  return corbot::cell::run_program(argc, argv,
                                   {.name = "corbot-store",
                                    .about = "Keeps the ledger of a cell's pieces",
                                    .run = corbot::cell::keep_ledger});
}
