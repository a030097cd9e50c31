// SPDX-License-Identifier: Apache-2.0
#include "motion/motion_results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

namespace corbot::test {

void MotionResults::see(const std::string& figure, double value) {
  double& known = worst[figure];
  known = std::max(known, value);
}

void MotionResults::add(const MotionResults& other) {
  for (const auto& [what, count] : other.counts) counts[what] += count;
  for (const auto& [figure, value] : other.worst) see(figure, value);
}

MotionResults add_to_file(const std::filesystem::path& file, std::uint64_t seed,
                          const MotionResults& results) {
  const nlohmann::json line{{"seed", seed}, {"counts", results.counts}, {"worst", results.worst}};
  if (!(std::ofstream(file, std::ios::app) << line.dump() + '\n').flush())
    throw std::runtime_error(file.string() + " cannot be written");
  MotionResults sum;
  std::ifstream stream(file);
  int number = 0;
  for (std::string text; std::getline(stream, text);) {
    ++number;
    try {
      const nlohmann::json past = nlohmann::json::parse(text);
      sum.add({past.at("counts").get<decltype(sum.counts)>(), past.at("worst").get<decltype(sum.worst)>()});
    } catch (const nlohmann::json::exception& error) {
      throw std::runtime_error(fmt::format("{}:{} is no result: {}", file.string(), number, error.what()));
    }
  }
  return sum;
}

MotionResults& run_results() {
  static MotionResults results;
  return results;
}

std::string to_string(const MotionResults& results) {
  std::vector<std::string> counts;
  std::vector<std::string> worst;
  for (const auto& [what, count] : results.counts) counts.push_back(fmt::format("{} {}", what, count));
  for (const auto& [figure, value] : results.worst) worst.push_back(fmt::format("{} {:.8g}", figure, value));
  return fmt::format("{}; worst: {}", fmt::join(counts, ", "), fmt::join(worst, ", "));
}

}  // namespace corbot::test
