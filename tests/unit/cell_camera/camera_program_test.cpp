// SPDX-License-Identifier: Apache-2.0
// corbot-camera as its clients see it, with the simulated scene as its source.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "cell.hh"
#include "support/paths.h"
#include "support/ports.h"
#include "support/process.h"

namespace corbot::cell {
namespace {

namespace fs = std::filesystem;
using test::within;

/// A noisy picture is a large file, larger than what the cell's other programs send and take.
TEST(CameraProgram, GivesALargePictureOfItsLastLook) {
  std::string path = CORBOT_SCRATCH_DIR "/camera-XXXXXX";
  const fs::path directory = ::mkdtemp(path.data());
  for (const auto& entry : fs::directory_iterator(CORBOT_CELL)) fs::copy(entry.path(), directory);
  std::ifstream in(directory / "cell.toml");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  text.replace(text.find("noise = 4"), 9, "noise = 50");
  std::ofstream(directory / "cell.toml") << text;
  const auto command = [&](const char* program) {
    return std::vector<std::string>{program,       directory / "cell.toml",
                                    "--ports",     std::to_string(test::free_ports(2) - 1),
                                    "--state-dir", directory / "state"};
  };
  test::Process scene(command(CORBOT_BIN_DIR "/corbot-scene"));
  ASSERT_TRUE(scene.wait_line("ready", within(30))) << scene.errors();
  test::Process camera(command(CORBOT_BIN_DIR "/corbot-camera"));
  const auto ready = camera.wait_line("ready ", within(30));
  ASSERT_TRUE(ready) << camera.errors();

  int argc = 0;
  const CORBA::ORB_var orb = CORBA::ORB_init(argc, nullptr);
  {
    const CORBA::Object_var object = orb->string_to_object(ready->substr(6).c_str());
    const Corbot::Camera_var reference = Corbot::Camera::_unchecked_narrow(object);
    EXPECT_THROW(Corbot::Jpeg_var(reference->Picture(true)), Corbot::NotReady);
    const Corbot::Frame_var frame = reference->Look(30);
    for (const bool marked : {false, true}) {
      Corbot::Jpeg_var jpeg = reference->Picture(marked);
      ASSERT_GT(jpeg->length(), 262'144U);
      EXPECT_EQ(jpeg[0], 0xff);
      EXPECT_EQ(jpeg[1], 0xd8);
    }
  }
  orb->destroy();
  fs::remove_all(directory);
}

}  // namespace
}  // namespace corbot::cell
