// SPDX-License-Identifier: Apache-2.0
#include "cell/camera/picture_view.h"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace corbot::cell {
namespace {

constexpr int kCorners = 48;  // corners of a round outline
constexpr double kLetters = 0.33;
constexpr int kRow_px = 13;

/// Draws light text with a dark edge, which is legible on every background.
void draw_text(cv::Mat& picture, const std::string& text, const cv::Point& at) {
  for (const auto& [colour, width] :
       {std::pair{cv::Scalar(0, 0, 0), 3}, std::pair{cv::Scalar(255, 255, 255), 1}})
    cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, kLetters, colour, width, cv::LINE_AA);
}

/// Returns the edge of a label in the picture. Empty if a part of the edge is behind the camera.
std::vector<cv::Point> outline_of(const CameraModel& camera, const Kind& kind, const Detection& piece) {
  const Eigen::Vector3d middle = piece.position_m + kind.height_m * Eigen::Vector3d::UnitZ();
  const int corners = kind.is_square ? 4 : kCorners;
  const double first = kind.is_square ? piece.yaw_rad + std::numbers::pi / 4 : 0;
  std::vector<cv::Point> outline;
  for (int i = 0; i < corners; ++i) {
    const double angle = first + 2 * std::numbers::pi * i / corners;
    const Eigen::Vector3d edge(std::cos(angle), std::sin(angle), 0);
    const auto pixel = camera.project(middle + kind.circle_m(kind.label_m) / 2 * edge);
    if (!pixel) return {};
    outline.emplace_back(static_cast<int>(std::lround(pixel->x())),
                         static_cast<int>(std::lround(pixel->y())));
  }
  return outline;
}

/// Draws kind and position below the outline, or above at the picture's edge. Labels of adjacent slots stay
/// apart.
void draw_label(cv::Mat& picture, const Detection& piece, const cv::Rect& box) {
  const std::array<std::string, 2> rows{
      piece.kind, fmt::format("{:.0f},{:.0f}", 1e3 * piece.position_m.x(), 1e3 * piece.position_m.y())};
  const bool is_below = box.y + box.height + 2 * kRow_px + 2 <= picture.rows;
  int y = is_below ? box.y + box.height + kRow_px : box.y - kRow_px - 4;
  for (const std::string& row : rows) {
    const int width = cv::getTextSize(row, cv::FONT_HERSHEY_SIMPLEX, kLetters, 1, nullptr).width;
    const int middle = box.x + box.width / 2 - width / 2;
    draw_text(picture, row, {std::clamp(middle, 0, std::max(0, picture.cols - width)), y});
    y += kRow_px;
  }
}

}  // namespace

void mark(std::span<std::uint8_t> bgr, const CellConfig& cell, const std::vector<Detection>& found) {
  const auto [columns, rows] = cell.camera.size_px;
  cv::Mat picture(rows, columns, CV_8UC3, bgr.data());
  for (const Detection& piece : found) {
    const Kind* const kind = cell.kind(piece.kind);
    if (kind == nullptr) continue;
    const std::vector<cv::Point> outline = outline_of(cell.camera, *kind, piece);
    if (outline.empty()) continue;
    cv::polylines(picture, outline, true, cv::Scalar(0, 0, 0), 4, cv::LINE_AA);
    cv::polylines(picture, outline, true, cv::Scalar(255, 255, 0), 2,
                  cv::LINE_AA);  // cyan, which no label has
    draw_label(picture, piece, cv::boundingRect(outline));
  }
  if (!found.empty()) draw_text(picture, "x,y in mm", {10, 20});
}

std::vector<std::uint8_t> to_jpeg(std::span<const std::uint8_t> bgr, std::array<int, 2> size_px) {
  const std::unique_ptr<void, decltype(&tjDestroy)> handle(tjInitCompress(), &tjDestroy);
  if (!handle) throw std::runtime_error(fmt::format("JPEG: {}", tjGetErrorStr2(nullptr)));
  for (const int quality : {90, 70, 40, 10}) {
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    const int status = tjCompress2(handle.get(), bgr.data(), size_px[0], 0, size_px[1], TJPF_BGR, &bytes,
                                   &size, TJSAMP_444, quality, TJFLAG_ACCURATEDCT);
    const std::unique_ptr<unsigned char, decltype(&tjFree)> owner(bytes, &tjFree);
    if (status != 0) throw std::runtime_error(fmt::format("JPEG: {}", tjGetErrorStr2(handle.get())));
    if (size <= kMostJpegBytes) return {bytes, bytes + size};
  }
  throw std::runtime_error(fmt::format("JPEG: the picture has more than {} bytes", kMostJpegBytes));
}

}  // namespace corbot::cell
