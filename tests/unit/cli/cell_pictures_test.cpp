// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_pictures.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "client/failure.h"

namespace corbot::cli {
namespace {

namespace fs = std::filesystem;

class RunPicturesTest : public testing::Test {
 protected:
  RunPicturesTest() {
    std::string path = testing::TempDir() + "corbot-pictures-XXXXXX";
    directory_ = ::mkdtemp(path.data());
  }
  ~RunPicturesTest() override { fs::remove_all(directory_); }
  fs::path directory_;
};

TEST_F(RunPicturesTest, ThoseOfAnEarlierRunDoNotStayBesideNewOnes) {
  std::ofstream(directory_ / "camera.jpg") << "of an earlier run";
  std::ofstream(directory_ / "notes.txt") << "of a person";
  prepare_pictures(directory_);
  EXPECT_FALSE(fs::exists(directory_ / "camera.jpg"));
  EXPECT_TRUE(fs::exists(directory_ / "notes.txt"));
}

TEST_F(RunPicturesTest, HalfAPictureIsNone) {
  fs::create_symlink("/dev/full", directory_ / "camera.jpg");
  const cell::CellConfig cell;
  const std::optional<cell::SceneRecord> no_record;
  CellEnd end;
  end.camera_jpeg.assign(100'000, 0xff);
  EXPECT_THROW(write_pictures(directory_, {cell, no_record, end}), client::Failure);
  EXPECT_FALSE(fs::is_symlink(directory_ / "camera.jpg"));
}

}  // namespace
}  // namespace corbot::cli
