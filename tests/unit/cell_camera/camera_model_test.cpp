// SPDX-License-Identifier: Apache-2.0
// The camera model and the upright frames against tables that OpenCV and numpy computed: tests/vectors/cell.
#include <gtest/gtest.h>

#include "cell/camera_model.h"
#include "cell/frames.h"
#include "support/arm_vectors.h"

namespace corbot::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d vector(const CsvRow& row, const std::string& letter) {
  return {number(row, letter + "x"), number(row, letter + "y"), number(row, letter + "z")};
}

cell::CameraModel camera(const CsvRow& row) {
  return {.size_px = {1280, 720},
          .focal_px = {number(row, "fx"), number(row, "fy")},
          .centre_px = {number(row, "cx"), number(row, "cy")},
          .distortion = {number(row, "k1"), number(row, "k2"), number(row, "p1"), number(row, "p2"),
                         number(row, "k3")},
          .position_m = vector(row, "p"),
          .world_T_camera = {number(row, "qw"), number(row, "qx"), number(row, "qy"), number(row, "qz")}};
}

TEST(CameraModel, ProjectsAsOpenCvDoesAndFindsThePointAgain) {
  const std::vector<CsvRow> rows = read_csv("../cell/camera_points.csv");
  ASSERT_GE(rows.size(), 90U);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    SCOPED_TRACE("row " + std::to_string(i + 2));
    const cell::CameraModel model = camera(rows[i]);
    const Vector3d point = vector(rows[i], "");
    const auto pixel = model.project(point);
    ASSERT_TRUE(pixel);
    EXPECT_LT((*pixel - Vector2d(number(rows[i], "u"), number(rows[i], "v"))).norm(), 1e-8);
    const auto found = model.on_plane(*pixel, point.z());
    ASSERT_TRUE(found);
    EXPECT_LT((*found - point).norm(), 1e-9);
  }
}

TEST(CameraModel, GivesNothingForWhatIsNotAhead) {
  const cell::CameraModel model;  // 1 m up, looks straight down
  EXPECT_FALSE(model.project({0, 0, 1.5}));
  EXPECT_FALSE(model.project({0, 0, 1}));
  EXPECT_FALSE(model.on_plane({600, 300}, 1.5));
  EXPECT_TRUE(model.on_plane({600, 300}, 0.5));
}

TEST(UprightFrame, ConvertsBothWaysAsHomogeneousMatricesDo) {
  const std::vector<CsvRow> rows = read_csv("../cell/upright_frames.csv");
  ASSERT_GE(rows.size(), 16U);
  for (const CsvRow& row : rows) {
    const cell::UprightFrame frame{vector(row, "p"), number(row, "yaw")};
    EXPECT_LT((frame.to_world(vector(row, "l")) - vector(row, "")).norm(), 1e-12);
    EXPECT_LT((frame.to_local(vector(row, "")) - vector(row, "l")).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace corbot::test
