// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace corbot::cli::charts {

/// Stands for a value that is not known.
inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// The least and the greatest of some values; empty without a value.
struct Range {
  double low{std::numeric_limits<double>::infinity()};
  double high{-std::numeric_limits<double>::infinity()};

  [[nodiscard]] bool empty() const noexcept { return !(low <= high); }
  void add(double value) noexcept;
  void add(const Range& other) noexcept;
};

/// Rows of values over time, at most `most` of them. If there are more, each two neighbours become one row
/// with the extremes of both. A record of any length therefore takes the same memory, and a spike of one row
/// remains.
class ReducedRows {
 public:
  struct Row {
    double begin_s{}, end_s{};
    std::vector<Range> ranges;  ///< for each series
  };

  explicit ReducedRows(std::size_t series, std::size_t most = 4096) : series_(series), most_(most) {}

  /// Adds a row; the times must increase.
  void add(double time_s, std::span<const double> values);
  [[nodiscard]] const std::vector<Row>& rows() const noexcept { return rows_; }
  /// Returns the range over all rows.
  [[nodiscard]] Range range(std::size_t series) const;

 private:
  void join_neighbours();

  std::size_t series_;
  std::size_t most_;
  std::size_t given_per_row_{1};
  std::size_t given_to_last_{0};
  std::vector<Row> rows_;
};

}  // namespace corbot::cli::charts
