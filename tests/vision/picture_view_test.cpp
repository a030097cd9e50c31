// SPDX-License-Identifier: Apache-2.0
// The picture that people look at: it survives JPEG, and marks are where the pieces are.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>

#include "cell/camera/picture_view.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

using cell::CellConfig;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Bytes = std::vector<std::uint8_t>;

struct Decoded {
  int columns{};
  int rows{};
  Bytes bgr;
};

Decoded decode(const Bytes& jpeg) {
  const std::unique_ptr<void, decltype(&tjDestroy)> handle(tjInitDecompress(), &tjDestroy);
  Decoded found;
  int sampling = 0;
  int colours = 0;
  EXPECT_EQ(tjDecompressHeader3(handle.get(), jpeg.data(), jpeg.size(), &found.columns, &found.rows,
                                &sampling, &colours),
            0);
  found.bgr.resize(3 * static_cast<std::size_t>(found.columns) * static_cast<std::size_t>(found.rows));
  EXPECT_EQ(tjDecompress2(handle.get(), jpeg.data(), jpeg.size(), found.bgr.data(), found.columns, 0,
                          found.rows, TJPF_BGR, 0),
            0);
  return found;
}

class PictureView : public testing::Test {
 protected:
  [[nodiscard]] std::size_t size() const {
    return 3 * static_cast<std::size_t>(cell_.camera.size_px[0]) *
           static_cast<std::size_t>(cell_.camera.size_px[1]);
  }
  /// Largest change of a value within 30 pixels of one, and the distance of the farthest changed pixel from
  /// it. The unit in the corner is no mark.
  struct Change {
    int most{0};
    double farthest_px{0};
  };
  [[nodiscard]] Change change(const Bytes& before, const Bytes& after, const Vector2d& about) const {
    Change found;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const auto pixel = static_cast<int>(i / 3);
      const Vector2d at(pixel % cell_.camera.size_px[0], pixel / cell_.camera.size_px[0]);
      const int difference = std::abs(before[i] - after[i]);
      if (difference == 0 || (at.x() < 120 && at.y() < 30)) continue;
      found.farthest_px = std::max(found.farthest_px, (at - about).norm());
      if ((at - about).norm() < 30) found.most = std::max(found.most, difference);
    }
    return found;
  }

  const CellConfig cell_ = cell::load_cell(CORBOT_CELL "/cell.toml");
};

TEST_F(PictureView, JpegHasTheSizeAndTheColoursOfThePicture) {
  Bytes bgr(size());
  for (std::size_t i = 0; i < bgr.size(); i += 3) {
    bgr[i] = 200;
    bgr[i + 1] = 100;
    bgr[i + 2] = 30;
  }
  const Decoded back = decode(cell::to_jpeg(bgr, cell_.camera.size_px));
  EXPECT_EQ(back.columns, cell_.camera.size_px[0]);
  EXPECT_EQ(back.rows, cell_.camera.size_px[1]);
  ASSERT_EQ(back.bgr.size(), bgr.size());
  EXPECT_NEAR(back.bgr[0], 200, 3);
  EXPECT_NEAR(back.bgr[1], 100, 3);
  EXPECT_NEAR(back.bgr[2], 30, 3);
}

TEST_F(PictureView, APictureOfManyDetailsKeepsTheBoundOfTheInterface) {
  Bytes bgr(size());
  std::mt19937 random(1);
  for (std::uint8_t& value : bgr) value = static_cast<std::uint8_t>(random());
  const Bytes jpeg = cell::to_jpeg(bgr, cell_.camera.size_px);
  EXPECT_LE(jpeg.size(), cell::kMostJpegBytes);
  EXPECT_EQ(decode(jpeg).columns, cell_.camera.size_px[0]);
}

TEST_F(PictureView, TheMarkIsWhereThePieceIs) {
  const cell::Kind& kind = cell_.kinds.front();
  for (const cell::Place& place : cell_.places) {
    const Vector3d foot = place.frame.position_m + Vector3d(0.02, 0.01, 0);
    const Bytes plain(size(), 128);
    Bytes marked = plain;
    cell::mark(marked, cell_, {{kind.name, foot, 1}});
    const auto about = cell_.camera.project(foot + Vector3d(0, 0, kind.height_m));
    ASSERT_TRUE(about);
    const Change found = change(plain, marked, *about);
    EXPECT_GT(found.most, 100) << place.name;
    EXPECT_LT(found.farthest_px, 60) << place.name << ": outline and text";
    const auto middle =
        3 * (static_cast<std::size_t>(about->y()) * static_cast<std::size_t>(cell_.camera.size_px[0]) +
             static_cast<std::size_t>(about->x()));
    EXPECT_EQ(marked[middle], 128) << "the piece itself stays to be seen";
  }
}

TEST_F(PictureView, TheMarkOfASquareIsTurnedLikeTheSquare) {
  CellConfig cell = cell_;
  cell::Kind& kind = cell.kinds.front();
  kind.is_square = true;
  const Vector3d foot = cell.places.front().frame.position_m;
  for (const double yaw : {-0.7, 0.0, 0.4}) {
    Bytes marked(size(), 128);
    cell::mark(marked, cell, {{kind.name, foot, 1, yaw}});
    const auto is_marked = [&](double from_side_rad, double radius_m) {
      const double angle = yaw + from_side_rad;
      const auto at = cell.camera.project(
          foot + Vector3d(radius_m * std::cos(angle), radius_m * std::sin(angle), kind.height_m));
      return marked[3 * (static_cast<std::size_t>(std::lround(at->y())) * 1280 +
                         static_cast<std::size_t>(std::lround(at->x())))] != 128;
    };
    for (int i = 0; i < 4; ++i) {
      const double side_rad = i * std::numbers::pi / 2;
      EXPECT_TRUE(is_marked(side_rad, kind.label_m / 2)) << yaw << ": middle of side " << i;
      EXPECT_FALSE(is_marked(side_rad, kind.label_m / std::numbers::sqrt2)) << yaw << ": beyond side " << i;
      EXPECT_TRUE(is_marked(side_rad + std::numbers::pi / 4, kind.label_m / std::numbers::sqrt2))
          << yaw << ": corner " << i;
    }
  }
}

TEST_F(PictureView, NothingFoundMarksNothing) {
  const Bytes plain(size(), 128);
  Bytes marked = plain;
  cell::mark(marked, cell_, {});
  EXPECT_EQ(marked, plain);
}

}  // namespace
}  // namespace corbot::test
