// SPDX-License-Identifier: Apache-2.0
#include "sim/scene/picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <utility>

#include <Eigen/Geometry>

#include <opencv2/imgproc.hpp>

namespace corbot::sim {
namespace {

using Eigen::Vector3d;

constexpr int kScale = 2;          // factor from the picture to the canvas
constexpr int kFraction = 4;       // bits of a canvas coordinate below 1
constexpr double kFarthest = 1e5;  // canvas pixels; farther points are not drawn
const cv::Scalar kTable(205, 208, 206);
const cv::Scalar kBody(42, 44, 46);
const cv::Scalar kArm(120, 118, 122);

/// A shape that is convex in the picture: the hull of these points, in one colour. A higher layer hides a
/// lower one.
struct Shape {
  double layer_m{};
  std::vector<Vector3d> points{};
  cv::Scalar colour{};
};

/// Adds a circle about `middle` in the plane of two unit vectors.
void add_circle(std::vector<Vector3d>& points, const Vector3d& middle, double radius_m, const Vector3d& u,
                const Vector3d& v) {
  constexpr int kPoints = 48;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    points.emplace_back(middle + radius_m * (std::cos(angle) * u + std::sin(angle) * v));
  }
}

/// Adds the outline of a piece or label in the plane of two unit vectors. A square has sides along them.
void add_outline(std::vector<Vector3d>& points, const Vector3d& middle, double width_m, bool is_square,
                 const Vector3d& u, const Vector3d& v) {
  if (!is_square) return add_circle(points, middle, width_m / 2, u, v);
  for (const auto& [along, across] : {std::pair{-1, -1}, {-1, 1}, {1, 1}, {1, -1}})
    points.emplace_back(middle + width_m / 2 * (along * u + across * v));
}

void add_sphere(std::vector<Vector3d>& points, const Vector3d& middle, double radius_m) {
  constexpr int kCircles = 8;
  for (int i = 0; i < kCircles; ++i) {
    const double angle = std::numbers::pi * i / kCircles;
    add_circle(points, middle, radius_m, Vector3d::UnitZ(), {std::cos(angle), std::sin(angle), 0});
  }
}

/// Adds a standing piece. The body lies in the layer of its foot: it hides only labels of pieces below its
/// foot.
void add_standing(std::vector<Shape>& shapes, const DrawnPiece& piece) {
  const Vector3d top = piece.foot_m + piece.height_m * Vector3d::UnitZ();
  const Vector3d along(std::cos(piece.yaw_rad), std::sin(piece.yaw_rad), 0);
  const Vector3d across = Vector3d::UnitZ().cross(along);
  Shape body{piece.foot_m.z(), {}, kBody};
  for (const Vector3d& middle : {piece.foot_m, top})
    add_outline(body.points, middle, piece.width_m, piece.is_square, along, across);
  Shape label{top.z(), {}, cv::Scalar(piece.label_bgr[0], piece.label_bgr[1], piece.label_bgr[2])};
  add_outline(label.points, top, piece.label_m, piece.is_square, along, across);
  shapes.push_back(std::move(body));
  shapes.push_back(std::move(label));
}

void add_lying(std::vector<Shape>& shapes, const DrawnPiece& piece) {
  const Vector3d along(std::cos(piece.yaw_rad), std::sin(piece.yaw_rad), 0);
  const Vector3d middle = piece.foot_m + piece.width_m / 2 * Vector3d::UnitZ();
  Shape body{piece.foot_m.z(), {}, kBody};
  for (const double end_m : {-piece.height_m / 2, piece.height_m / 2})
    add_outline(body.points, middle + end_m * along, piece.width_m, piece.is_square, Vector3d::UnitZ(),
                Vector3d::UnitZ().cross(along));
  shapes.push_back(std::move(body));
}

void sort_by_layer(std::vector<Shape>& shapes) {
  std::stable_sort(shapes.begin(), shapes.end(),
                   [](const Shape& a, const Shape& b) { return a.layer_m < b.layer_m; });
}

}  // namespace

struct Picture::State {
  explicit State(PictureOptions given)
      : options(std::move(given)),
        canvas(kScale * options.rows, kScale * options.columns, CV_8UC3),
        noise(options.rows, options.columns, CV_16SC3),
        bytes(static_cast<std::size_t>(options.rows) * options.columns * 3),
        random(options.seed) {
    cv::RNG(random()).fill(noise, cv::RNG::NORMAL, 0, options.noise);
  }

  void fill(const Shape& shape) {
    std::vector<cv::Point2f> seen;
    for (const Vector3d& point : shape.points) {
      const auto pixel = options.project(point);
      if (!pixel) continue;
      const Eigen::Vector2d at =
          kScale * (pixel->array() + 0.5) - 0.5;  // middles of pixels are whole numbers
      if (at.cwiseAbs().maxCoeff() < kFarthest) seen.emplace_back(at.x(), at.y());
    }
    if (seen.size() < 3) return;
    std::vector<cv::Point2f> hull;
    cv::convexHull(seen, hull);
    const cv::Point2f middle =
        std::accumulate(hull.begin(), hull.end(), cv::Point2f()) / static_cast<float>(hull.size());
    std::vector<cv::Point> fixed;
    for (const cv::Point2f& corner : hull) {
      // fillConvexPoly fills every pixel that the outline touches, which is half a pixel too much.
      const cv::Point2f out = corner - middle;
      const cv::Point2f inner = corner - out * (0.5F / std::max(std::hypot(out.x, out.y), 0.5F));
      fixed.push_back(inner * static_cast<float>(1 << kFraction));  // rounds
    }
    cv::fillConvexPoly(canvas, fixed, shape.colour, cv::LINE_8, kFraction);
  }

  /// Adds the field of noise, rolled by so many rows and columns.
  void add_noise(cv::Mat& picture, int down, int right) const {
    for (int row = 0; row < picture.rows; ++row) {
      const cv::Mat field = noise.row((row + down) % noise.rows);
      const auto add = [&](int to, int from, int count) {
        if (count == 0) return;
        cv::Mat part = picture.row(row).colRange(to, to + count);
        cv::add(part, field.colRange(from, from + count), part, cv::noArray(), CV_8U);
      };
      add(0, right, picture.cols - right);
      add(picture.cols - right, 0, right);
    }
  }

  PictureOptions options;
  cv::Mat canvas;
  cv::Mat noise;
  std::vector<std::uint8_t> bytes;
  std::mt19937_64 random;
};

Picture::Picture(PictureOptions options) {
  cv::setNumThreads(1);
  state_ = std::make_unique<State>(std::move(options));
}

Picture::~Picture() = default;

const std::vector<std::uint8_t>& Picture::draw(std::span<const DrawnPiece> pieces,
                                               std::span<const Capsule> arms) {
  State& state = *state_;
  std::vector<Shape> standing;
  for (const DrawnPiece& piece : pieces)
    piece.is_lying ? add_lying(standing, piece) : add_standing(standing, piece);
  sort_by_layer(standing);
  std::vector<Shape> bodies;
  for (const Capsule& arm : arms) {
    Shape body{std::max(arm.from_m.z(), arm.to_m.z()), {}, kArm};
    add_sphere(body.points, arm.from_m, arm.radius_m);
    add_sphere(body.points, arm.to_m, arm.radius_m);
    bodies.push_back(std::move(body));
  }
  sort_by_layer(bodies);

  state.canvas = kTable;
  for (const std::vector<Shape>* shapes : {&standing, &bodies})
    for (const Shape& shape : *shapes) state.fill(shape);
  cv::Mat picture(state.options.rows, state.options.columns, CV_8UC3, state.bytes.data());
  cv::resize(state.canvas, picture, picture.size(), 0, 0, cv::INTER_AREA);
  if (state.options.noise > 0) {
    const auto below = [&](int count) {
      return std::uniform_int_distribution<int>(0, count - 1)(state.random);
    };
    const int down = below(picture.rows);
    state.add_noise(picture, down, below(picture.cols));
  }
  return state.bytes;
}

}  // namespace corbot::sim
