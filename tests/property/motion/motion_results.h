// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace corbot::test {

/// Figures of a run of random motions. Those of several runs add up: counts are summed, and the worst of each
/// figure stays.
struct MotionResults {
  std::map<std::string, std::uint64_t> counts;
  std::map<std::string, double> worst;

  void see(const std::string& figure, double value);
  void add(const MotionResults& other);
};

/// Appends a line with the results to the file and returns the sum of all its lines. Throws
/// std::runtime_error where the file cannot be written or a line is no result.
MotionResults add_to_file(const std::filesystem::path& file, std::uint64_t seed,
                          const MotionResults& results);

/// The results of all cases of this run.
MotionResults& run_results();

/// "arcs 12, lines 30, ...; worst: joint_speed 1.0000001, ..."
std::string to_string(const MotionResults& results);

}  // namespace corbot::test
