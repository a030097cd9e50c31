// SPDX-License-Identifier: Apache-2.0
// corbot-camera: the object Camera of a cell.
#include "cell/camera/camera_servant.h"
#include "cell/camera/picture_view.h"
#include "cell/orb_server.h"
#include "cell/program.h"

int main(int argc, char** argv) {
  using namespace corbot::cell;
  return run_program(argc, argv,
                     {.name = "corbot-camera",
                      .about = "Takes pictures of a cell and finds the pieces in them.",
                      .run = [](const CellConfig& cell) {
                        CameraServant servant(cell);
                        OrbServer server(cell.host, cell.camera_port(), kMostJpegBytes + 4096);
                        server.activate(kCameraKey, &servant);
                        server.serve(kCameraKey);
                      }});
}
