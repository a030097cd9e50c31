// SPDX-License-Identifier: Apache-2.0
#include "cell/camera/detector.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <stdexcept>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <opencv2/imgproc.hpp>

#include "cell/cell_rules.h"

namespace corbot::cell {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBeyondEdge_m = 0.010;
constexpr double kLeastLabel_px = 11;  // labels of fewer pixels were missed in rendered pictures
// In 15000 rendered pictures fully visible labels of 8, 14 and 16 mm reached at least 0.85. The position
// error of partly hidden labels above this limit was at most 1.4 mm.
constexpr double kLeastAgreement = 0.82;

/// Returns the mask of a kind's colour without small specks and holes.
cv::Mat pixels_of(const Kind& kind, const cv::Mat& hsv) {
  const auto from_to = [&](double from_deg, double to_deg) {
    cv::Mat found;
    // OpenCV's hue has steps of 2 degrees; saturation and value go from 0 to 255.
    cv::inRange(hsv, cv::Scalar(from_deg / 2, 255 * kind.saturation_min, 255 * kind.value_min),
                cv::Scalar(to_deg / 2, 255, 255), found);
    return found;
  };
  const auto [first, last] = kind.hue_deg;
  cv::Mat mask = first <= last ? from_to(first, last) : from_to(first, 360) | from_to(0, last);
  // Noise takes single pixels of a dark label out of its hues. An opening would widen each hole to a strip.
  cv::medianBlur(mask, mask, 3);
  return mask;
}

/// One connected region of a kind's colour.
struct Blob {
  std::vector<Vector2d> pixels{};  ///< in the picture
  Vector2d middle{};               ///< centroid, weighted by saturation
};

Blob blob_of(const cv::Mat& labels, int label, const cv::Rect& box, const cv::Mat& hsv,
             const Vector2d& origin) {
  Blob blob;
  Vector2d sum = Vector2d::Zero();
  double weights = 0;
  for (int row = box.y; row < box.y + box.height; ++row) {
    for (int column = box.x; column < box.x + box.width; ++column) {
      if (labels.at<int>(row, column) != label) continue;
      const double weight = hsv.at<cv::Vec3b>(row, column)[1];
      blob.pixels.emplace_back(origin + Vector2d(column, row));
      sum += weight * blob.pixels.back();
      weights += weight;
    }
  }
  blob.middle = sum / weights;
  return blob;
}

/// A label's outline near a pixel, by the linear map from the picture to the label's plane at that pixel.
struct Outline {
  Vector3d top_m;  ///< middle of the label
  Eigen::Matrix2d metres_by_pixel;
  double half_m{};  ///< radius, or half a side
  bool is_square{false};
  double yaw_rad{0};

  [[nodiscard]] double area_px() const {
    return (is_square ? 4 : std::numbers::pi) * half_m * half_m / std::abs(metres_by_pixel.determinant());
  }
  /// Returns the share of a pixel within the outline, from 0 to 1. `offset_px`: from the label's middle.
  [[nodiscard]] double share(const Vector2d& offset_px) const {
    const Vector2d local = Eigen::Rotation2Dd(-yaw_rad) * Vector2d(metres_by_pixel * offset_px);
    const double inside_m = half_m - (is_square ? local.cwiseAbs().maxCoeff() : local.norm());
    return std::clamp(inside_m / std::sqrt(std::abs(metres_by_pixel.determinant())) + 0.5, 0.0, 1.0);
  }
};

std::optional<Outline> outline_at(const CameraModel& camera, const Vector2d& pixel, double z_m,
                                  const Kind& kind) {
  const auto here = camera.on_plane(pixel, z_m);
  const auto right = camera.on_plane(pixel + Vector2d(1, 0), z_m);
  const auto down = camera.on_plane(pixel + Vector2d(0, 1), z_m);
  if (!here || !right || !down) return std::nullopt;
  Outline outline{*here, {}, kind.label_m / 2, kind.is_square};
  outline.metres_by_pixel << (*right - *here).head<2>(), (*down - *here).head<2>();
  return outline;
}

/// Returns the yaw of a square blob, from -pi/4 up to pi/4. The mean of (x + iy)^4 over a square with its
/// sides along x and y is negative and real. A turn by the yaw multiplies the mean by exp(4i yaw).
double yaw_of(const Blob& blob, const Outline& outline) {
  std::complex<double> sum;
  for (const Vector2d& pixel : blob.pixels) {
    const Vector2d offset_m = outline.metres_by_pixel * (pixel - blob.middle);
    const std::complex<double> offset(offset_m.x(), offset_m.y());
    const std::complex<double> square = offset * offset;
    sum -= square * square;
  }
  const double yaw_rad = std::arg(sum) / 4;
  return yaw_rad < std::numbers::pi / 4 ? yaw_rad : -std::numbers::pi / 4;
}

/// Returns the intersection of blob and outline, divided by their union.
double agreement(const Blob& blob, const Outline& outline) {
  double shared = 0;
  for (const Vector2d& pixel : blob.pixels) shared += outline.share(pixel - blob.middle);
  return shared / (static_cast<double>(blob.pixels.size()) + outline.area_px() - shared);
}

/// Returns the picture's rectangle that shows a place with the margin `beyond_m`, `above_m` above its
/// surface.
cv::Rect seen(const CameraModel& camera, const Place& place, double above_m, double beyond_m) {
  const Vector2d half = place.half_size_m().array() + beyond_m;
  std::vector<cv::Point2f> corners;
  for (const Vector2d& sign : {Vector2d(-1, -1), Vector2d(-1, 1), Vector2d(1, -1), Vector2d(1, 1)}) {
    const Vector2d corner = half.cwiseProduct(sign);
    // A corner behind the camera is outside every picture.
    const Vector2d pixel = camera.project(place.frame.to_world({corner.x(), corner.y(), above_m}))
                               .value_or(Vector2d(-1e6, -1e6));
    corners.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  }
  return cv::boundingRect(corners);
}

bool is_at_edge(const cv::Rect& box, const cv::Size& size) {
  return box.x == 0 || box.y == 0 || box.x + box.width == size.width || box.y + box.height == size.height;
}

/// Returns the piece below a blob, or nothing if the blob is not a whole label over the place.
std::optional<Detection> examine(const Blob& blob, const Kind& kind, const Place& place,
                                 const CameraModel& camera) {
  auto outline = outline_at(camera, blob.middle, place.frame.position_m.z() + kind.height_m, kind);
  if (!outline) return std::nullopt;
  if (kind.is_square) outline->yaw_rad = yaw_of(blob, *outline);
  const double confidence = agreement(blob, *outline);
  const Vector3d foot = outline->top_m - kind.height_m * Vector3d::UnitZ();
  if (!(confidence >= kLeastAgreement) || !place.covers(foot, kBeyondEdge_m)) return std::nullopt;
  return Detection{kind.name, foot, std::min(confidence, 1.0), outline->yaw_rad};
}

/// Returns the width in pixels of a label in the middle of the place; 0 if the picture does not show it.
double label_px(const CameraModel& camera, const Place& place, const Kind& kind) {
  const Vector3d label_m = place.frame.position_m + kind.height_m * Vector3d::UnitZ();
  const auto pixel = camera.project(label_m);
  const auto outline = pixel ? outline_at(camera, *pixel, label_m.z(), kind) : std::nullopt;
  return outline ? kind.label_m / std::sqrt(std::abs(outline->metres_by_pixel.determinant())) : 0;
}

}  // namespace

Detector::Detector(const CellConfig& cell) : camera_(cell.camera), kinds_(cell.kinds) {
  cv::setNumThreads(1);
  const cv::Rect picture(0, 0, camera_.size_px[0], camera_.size_px[1]);
  std::vector<ConfigFault> faults;
  for (const Place& place : cell.places) {
    cv::Rect window;
    for (const Kind& kind : kinds_) {
      if (!shows(camera_, place, kind))
        faults.push_back(
            {.file = "cell " + cell.name,
             .line = 0,
             .key = "camera.calibration",
             .value = place.name,
             .allowed = "the picture must show the whole place; it does not with this calibration",
             .name = ""});
      if (const double width_px = label_px(camera_, place, kind); width_px < kLeastLabel_px)
        faults.push_back({.file = "cell " + cell.name,
                          .line = 0,
                          .key = "kind.label_m",
                          .value = fmt::format("{}", kind.label_m),
                          .allowed = fmt::format("is {:.1f} pixels wide on {}, and must be {:g} or more",
                                                 width_px, place.name, kLeastLabel_px),
                          .name = kind.name});
      // The margin is so wide that the window holds every label that counts.
      window |= seen(camera_, place, kind.height_m, kBeyondEdge_m + kind.label_m);
    }
    window &= picture;
    windows_.push_back({place, window.x, window.y, window.width, window.height});
  }
  if (!faults.empty()) throw ConfigError(std::move(faults));
}

std::vector<Detection> Detector::detect(std::span<const std::uint8_t> bgr) const {
  const auto [columns, rows] = camera_.size_px;
  const std::size_t expected = 3 * static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  if (bgr.size() != expected)
    throw std::invalid_argument(
        fmt::format("a picture of {} bytes, not {}: the calibration is for {} x {} pixels", bgr.size(),
                    expected, columns, rows));
  const cv::Mat picture(rows, columns, CV_8UC3, const_cast<std::uint8_t*>(bgr.data()));  // only read
  std::vector<Detection> found;
  for (const Window& window : windows_) {
    cv::Mat hsv;
    cv::cvtColor(picture(cv::Rect(window.left, window.top, window.columns, window.rows)), hsv,
                 cv::COLOR_BGR2HSV);
    for (const Kind& kind : kinds_) {
      cv::Mat labels;
      cv::Mat stats;
      cv::Mat middles;
      const int count = cv::connectedComponentsWithStats(pixels_of(kind, hsv), labels, stats, middles);
      for (int label = 1; label < count; ++label) {  // 0 is the rest of the picture
        const int* const stat = stats.ptr<int>(label);
        const cv::Rect box(stat[cv::CC_STAT_LEFT], stat[cv::CC_STAT_TOP], stat[cv::CC_STAT_WIDTH],
                           stat[cv::CC_STAT_HEIGHT]);
        if (is_at_edge(box, hsv.size())) continue;
        const Blob blob = blob_of(labels, label, box, hsv, {window.left, window.top});
        const auto detection = examine(blob, kind, window.place, camera_);
        const auto is_known = [&](const Detection& other) {  // found already over a neighbouring place
          return (other.position_m - detection->position_m).norm() < kind.label_m / 2;
        };
        if (detection && std::none_of(found.begin(), found.end(), is_known)) found.push_back(*detection);
      }
    }
  }
  return found;
}

}  // namespace corbot::cell
