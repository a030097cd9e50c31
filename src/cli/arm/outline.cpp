// SPDX-License-Identifier: Apache-2.0
#include "cli/arm/outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace corbot::cli {
namespace {

constexpr double kTolerance_cells = 0.3;  // largest error by an omitted point
constexpr std::array<std::array<int, 2>, 4> kSteps{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};

/// Walks along the edges of marked cells, which are on the left, and visits each edge once.
class Walk {
 public:
  explicit Walk(const ReachRegion& region) : region_(region), walked_(region.columns * region.rows, 0) {}

  /// Returns the middles of the edges, in cells, from the lower edge of this cell on.
  Outline from(std::size_t column, std::size_t row) {
    Outline line;
    std::size_t direction = 0;
    auto x = static_cast<long>(column);
    auto y = static_cast<long>(row);
    while (!is_walked(x, y, direction)) {
      const auto [right, up] = kSteps[direction];
      line.push_back({static_cast<double>(x) + 0.5 * right, static_cast<double>(y) + 0.5 * up});
      x += right;
      y += up;
      // The walk turns left if that is an edge, else it goes ahead, else right. Cells that touch only at a
      // corner stay separate.
      for (const std::size_t turn : {1U, 0U, 3U}) {
        const std::size_t next = (direction + turn) % 4;
        if (!is_edge(x, y, next)) continue;
        direction = next;
        break;
      }
    }
    return line;
  }
  [[nodiscard]] bool starts(std::size_t column, std::size_t row) const {
    const auto x = static_cast<long>(column);
    const auto y = static_cast<long>(row);
    return is_edge(x, y, 0) && (walked_[row * region_.columns + column] & 1) == 0;
  }

 private:
  [[nodiscard]] bool is_walked(long x, long y, std::size_t direction) {
    char& walked = walked_[static_cast<std::size_t>(y) * region_.columns + static_cast<std::size_t>(x)];
    const char bit = static_cast<char>(1 << direction);
    if ((walked & bit) != 0) return true;
    walked = static_cast<char>(walked | bit);
    return false;
  }
  [[nodiscard]] bool marked(long column, long row) const {
    return region_.at(static_cast<std::size_t>(column), static_cast<std::size_t>(row));
  }
  /// Returns true for an edge from this corner in this direction: marked on the left and empty on the right.
  [[nodiscard]] bool is_edge(long x, long y, std::size_t direction) const {
    constexpr std::array<std::array<int, 2>, 4> kLeft{{{0, 0}, {-1, 0}, {-1, -1}, {0, -1}}};
    const auto& left = kLeft[direction];
    const auto& right = kLeft[(direction + 3) % 4];
    return marked(x + left[0], y + left[1]) && !marked(x + right[0], y + right[1]);
  }

  const ReachRegion& region_;
  // one bit for each direction of the edges from the lower left corner of each cell
  std::vector<char> walked_;
};

/// Replaces each point by the mean of nine, which removes the stairs.
Outline smoothed(const Outline& line) {
  const std::size_t count = line.size();
  if (count < 20) return line;
  Outline smooth(count, PlanePoint{});
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < 9; ++k) {
      const PlanePoint& p = line[(i + count + k - 4) % count];
      smooth[i] = {smooth[i][0] + p[0] / 9.0, smooth[i][1] + p[1] / 9.0};
    }
  }
  return smooth;
}

double distance_to_chord(const PlanePoint& p, const PlanePoint& a, const PlanePoint& b) {
  const PlanePoint along{b[0] - a[0], b[1] - a[1]};
  const double length = std::hypot(along[0], along[1]);
  if (length < 1e-12) return std::hypot(p[0] - a[0], p[1] - a[1]);
  return std::abs(along[0] * (p[1] - a[1]) - along[1] * (p[0] - a[0])) / length;
}

/// Keeps the points between two that a line without them would miss (Douglas and Peucker 1973).
void simplify(const Outline& line, std::size_t first, std::size_t last, Outline& kept) {
  std::size_t farthest = first;
  double most = kTolerance_cells;
  for (std::size_t i = first + 1; i < last; ++i) {
    const double distance = distance_to_chord(line[i], line[first], line[last % line.size()]);
    if (distance <= most) continue;
    most = distance;
    farthest = i;
  }
  if (farthest == first) return;
  simplify(line, first, farthest, kept);
  kept.push_back(line[farthest]);
  simplify(line, farthest, last, kept);
}

}  // namespace

std::vector<Outline> outlines_of(const ReachRegion& region) {
  std::vector<Outline> outlines;
  Walk walk(region);
  for (std::size_t row = 1; row < region.rows; ++row) {
    for (std::size_t column = 1; column < region.columns; ++column) {
      if (!walk.starts(column, row)) continue;
      const Outline line = smoothed(walk.from(column, row));
      const std::size_t middle = line.size() / 2;
      Outline kept{line[0]};
      simplify(line, 0, middle, kept);
      kept.push_back(line[middle]);
      simplify(line, middle, line.size(), kept);
      for (PlanePoint& p : kept)
        p = {region.low_m[0] + p[0] * region.cell_m, region.low_m[1] + p[1] * region.cell_m};
      outlines.push_back(kept);
    }
  }
  return outlines;
}

}  // namespace corbot::cli
