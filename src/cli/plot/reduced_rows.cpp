// SPDX-License-Identifier: Apache-2.0
#include "cli/plot/reduced_rows.h"

#include <algorithm>
#include <utility>

namespace corbot::cli::charts {

void Range::add(double value) noexcept {
  if (value < low) low = value;
  if (value > high) high = value;
}

void Range::add(const Range& other) noexcept {
  low = std::min(low, other.low);
  high = std::max(high, other.high);
}

void ReducedRows::add(double time_s, std::span<const double> values) {
  if (rows_.empty() || given_to_last_ == given_per_row_) {
    if (rows_.size() == most_) join_neighbours();
    rows_.push_back({time_s, time_s, std::vector<Range>(series_)});
    given_to_last_ = 0;
  }
  Row& row = rows_.back();
  row.end_s = time_s;
  for (std::size_t i = 0; i < series_; ++i) row.ranges[i].add(values[i]);
  ++given_to_last_;
}

void ReducedRows::join_neighbours() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < rows_.size(); i += 2, ++kept) {
    if (kept != i) rows_[kept] = std::move(rows_[i]);
    if (i + 1 == rows_.size()) continue;
    rows_[kept].end_s = rows_[i + 1].end_s;
    for (std::size_t k = 0; k < series_; ++k) rows_[kept].ranges[k].add(rows_[i + 1].ranges[k]);
  }
  rows_.resize(kept);
  given_per_row_ *= 2;
}

Range ReducedRows::range(std::size_t series) const {
  Range all;
  for (const Row& row : rows_) all.add(row.ranges[series]);
  return all;
}

}  // namespace corbot::cli::charts
