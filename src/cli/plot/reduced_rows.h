// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace corbot::cli::charts {

/// In place of a value that is not known.
inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// The least and the greatest of some values; without one it is empty.
struct Range {
  double low{std::numeric_limits<double>::infinity()};
  double high{-std::numeric_limits<double>::infinity()};

  [[nodiscard]] bool empty() const noexcept { return !(low <= high); }
  void add(double value) noexcept;
  void add(const Range& other) noexcept;
};

/// Rows of values over time, of which `most` at the most are kept: when there are more, each two neighbours become one with the
/// extremes of both. So a record of any length takes the same memory, and a spike of one row stays.
class ReducedRows {
 public:
  struct Row {
    double begin_s{}, end_s{};
    std::vector<Range> ranges;  ///< of each series
  };

  explicit ReducedRows(std::size_t series, std::size_t most = 4096) : series_(series), most_(most) {}

  /// The times increase.
  void add(double time_s, std::span<const double> values);
  [[nodiscard]] const std::vector<Row>& rows() const noexcept { return rows_; }
  /// Of all rows.
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
