// SPDX-License-Identifier: Apache-2.0
#include "cli/plot/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <string_view>

#include "client/explain.h"
#include "client/failure.h"
#include "client/number.h"

namespace corbot::cli::charts {
namespace {

using client::ExitCode;
using client::Failure;

constexpr std::size_t kNoColumn = static_cast<std::size_t>(-1);

void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  for (;;) {
    const std::size_t comma = line.find(',');
    fields.push_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return;
    line.remove_prefix(comma + 1);
  }
}

/// Returns the text between the first `begin` and the last `end`.
std::optional<std::string_view> between(std::string_view text, std::string_view begin, std::string_view end) {
  const std::size_t from = text.find(begin);
  const std::size_t to = text.rfind(end);
  if (from == std::string_view::npos || to == std::string_view::npos || to < from + begin.size())
    return std::nullopt;
  return text.substr(from + begin.size(), to - from - begin.size());
}

/// Parses limits such as "-90 to 90 deg, 60 deg/s, 240 deg/s2, 2400 deg/s3".
std::optional<RecordedLimits> limits_of(std::string_view text) {
  std::vector<double> numbers;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    if (const auto number = client::parse_number(text.substr(0, end))) numbers.push_back(*number);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  if (numbers.size() != 5) return std::nullopt;
  return RecordedLimits{numbers[0], numbers[1], numbers[2], numbers[3], numbers[4]};
}

class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file), stream_(file) {
    if (!stream_) throw Failure(ExitCode::kUsage, file + ": " + std::strerror(errno));
  }

  Recording read() {
    while (next() && line_.starts_with('#')) note();
    if (!stream_)
      throw Failure(
          ExitCode::kUsage,
          file_ + ": the file has no line with the names of columns, so it is no file of 'corbot record'");
    columns();
    recording_.rows = ReducedRows(recording_.gripper_pulse() + 1);
    while (next()) row();
    if (recording_.cycles < 2)
      throw Failure(ExitCode::kUsage,
                    fmt::format("{}: the file has {} cycles, a drawing needs at least 2: record for longer",
                                file_, recording_.cycles));
    return std::move(recording_);
  }

 private:
  struct Columns {
    std::size_t set_point, measured, speed, pulse;
  };

  [[noreturn]] void fail(const std::string& why) const {
    throw Failure(ExitCode::kUsage, fmt::format("{}:{}: {}", file_, number_, why));
  }

  bool next() {
    if (!std::getline(stream_, line_)) {
      if (stream_.bad()) throw Failure(ExitCode::kInternal, file_ + ": cannot be read");
      return false;
    }
    ++number_;
    if (line_.ends_with('\r')) line_.pop_back();
    return true;
  }

  void note() {
    if (line_.starts_with("# profile '")) {
      recording_.profile = client::printable(between(line_, "# profile '", "';").value_or(""));
    } else if (line_.starts_with(fmt::format("# joint {} '", noted_.size()))) {
      const auto name = between(line_, "'", "': ");
      const auto limits =
          name ? limits_of(std::string_view(line_).substr(line_.rfind("': ") + 3)) : std::nullopt;
      if (!limits)
        fail("the line must have the name of a joint and five limits: " + client::printable(line_));
      noted_.push_back({JointKind::kRotary, client::printable(*name), limits});
    }
  }

  [[nodiscard]] std::size_t column(const std::string& name) const {
    const auto found = std::find(names_.begin(), names_.end(), name);
    return found == names_.end() ? kNoColumn : static_cast<std::size_t>(found - names_.begin());
  }
  [[nodiscard]] std::size_t needed(const std::string& name) const {
    const std::size_t found = column(name);
    if (found == kNoColumn)
      fail(fmt::format("column '{}' is missing, so this is no file of 'corbot record'", name));
    return found;
  }

  void columns() {
    split(line_, fields_);
    names_.assign(fields_.begin(), fields_.end());
    cycle_ = needed("cycle");
    time_ = needed("time_ns");
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      const std::string turning = fmt::format("theta{}_deg", i);
      const std::string sliding = fmt::format("slide{}_m", i);
      const bool slides = column(sliding) != kNoColumn;
      const std::string& name = slides ? sliding : turning;
      if (column(name) == kNoColumn) continue;
      if (i > columns_.size()) fail(fmt::format("the column of joint {} is missing", columns_.size()));
      columns_.push_back({column(name), column("measured_" + name), column(name + "_s"),
                          column(fmt::format("pulse{}_us", i))});
      recording_.joints.push_back({slides ? JointKind::kPrismatic : JointKind::kRotary, "", std::nullopt});
    }
    if (columns_.empty()) (void)needed("theta0_deg");
    gripper_ = column("gripper_us");
    if (noted_.empty()) return;
    if (noted_.size() != columns_.size())
      fail(
          fmt::format("the file has limits of {} joints, but columns of {}", noted_.size(), columns_.size()));
    for (std::size_t i = 0; i < noted_.size(); ++i) {
      recording_.joints[i].name = noted_[i].name;
      recording_.joints[i].limits = noted_[i].limits;
    }
  }

  /// Returns no value for an empty field and for a missing column.
  [[nodiscard]] double value(std::size_t column, bool may_be_empty = false) const {
    if (column == kNoColumn || (may_be_empty && fields_[column].empty())) return kNoValue;
    const auto number = client::parse_number(fields_[column]);
    if (!number)
      fail(fmt::format("column '{}': '{}' is not a number", client::printable(names_[column]),
                       client::printable(fields_[column])));
    return *number;
  }

  void row() {
    split(line_, fields_);
    if (fields_.size() != names_.size())
      fail(fmt::format("the line has {} fields, but the file has {} columns", fields_.size(), names_.size()));
    const double cycle = value(cycle_);
    const double time_ns = value(time_);
    if (recording_.cycles == 0) {
      begin_ns_ = time_ns;
    } else if (time_ns <= time_ns_) {
      fail(fmt::format("time_ns {} is not after {} of the line before", time_ns, time_ns_));
    }
    // A restarted task counts from zero.
    if (cycle > cycle_before_ + 1 && recording_.cycles > 0)
      recording_.missing += static_cast<std::uint64_t>(cycle - cycle_before_) - 1;
    const bool follows = recording_.cycles > 0 && cycle == cycle_before_ + 1;
    values(follows && !is_gap(time_ns - time_ns_) ? 1e-9 * period_ns_ : kNoValue);
    recording_.rows.add(1e-9 * (time_ns - begin_ns_), values_);
    ++recording_.cycles;
    cycle_before_ = cycle;
    time_ns_ = time_ns;
  }

  /// Counts a late cycle. The shortest step so far is the period. A late cycle moves the set-points by one
  /// period, and after more than five missed periods it begins the motion again from rest.
  bool is_gap(double step_ns) {
    constexpr double kLate = 1.5, kLongest = 5.5;  // periods
    period_ns_ = std::min(period_ns_, step_ns);
    if (step_ns <= kLate * period_ns_) return false;
    ++recording_.late;
    recording_.latest_s = std::max(recording_.latest_s, 1e-9 * (step_ns - period_ns_));
    return step_ns > kLongest * period_ns_;
  }

  /// `period_s`: time by which the set-points moved on; not a number if the previous cycle is missing, or
  /// after a gap.
  void values(double period_s) {
    values_.assign(recording_.gripper_pulse() + 1, kNoValue);
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const auto at = [&](Quantity quantity) -> double& {
        return values_[Recording::series_of(i, quantity)];
      };
      at(Quantity::kSetPoint) = value(columns_[i].set_point);
      at(Quantity::kMeasured) = value(columns_[i].measured, true);
      at(Quantity::kPulse) = value(columns_[i].pulse);
      rates_[i] = rates_[i].next(value(columns_[i].speed), period_s);
      at(Quantity::kSpeed) = rates_[i].speed;
      at(Quantity::kAcceleration) = rates_[i].acceleration;
      at(Quantity::kJerk) = rates_[i].jerk;
    }
    values_.back() = value(gripper_);
  }

  const std::string file_;
  std::ifstream stream_;
  std::string line_;
  std::uint64_t number_{0};
  std::vector<std::string> names_;
  std::vector<std::string_view> fields_;
  std::vector<RecordedJoint> noted_;
  std::size_t cycle_{}, time_{}, gripper_{};
  std::vector<Columns> columns_;
  double begin_ns_{}, time_ns_{}, cycle_before_{}, period_ns_{std::numeric_limits<double>::infinity()};
  std::array<JointRates, kMaxJoints> rates_{};
  std::vector<double> values_;
  Recording recording_;
};

}  // namespace

Recording read_recording(const std::string& file) { return Reader(file).read(); }

}  // namespace corbot::cli::charts
