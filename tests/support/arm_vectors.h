// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "corbot/kinematics/dh_table.h"
#include "support/paths.h"

// The arms of tests/vectors/arms. See its README.

namespace corbot::test {

using CsvRow = std::map<std::string, std::string>;

/// All rows of a file by the names in its first line; throws where it cannot be read.
inline std::vector<CsvRow> read_csv(const std::string& name) {
  const std::string path = std::string(CORBOT_ARM_VECTORS) + "/" + name;
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  const auto split = [](const std::string& line) {
    std::vector<std::string> cells;
    std::stringstream in(line);
    for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
    return cells;
  };
  std::string line;
  std::getline(file, line);
  const std::vector<std::string> names = split(line);
  std::vector<CsvRow> rows;
  while (std::getline(file, line)) {
    const std::vector<std::string> cells = split(line);
    CsvRow row;
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = i < cells.size() ? cells[i] : "";
    rows.push_back(std::move(row));
  }
  return rows;
}

inline double number(const CsvRow& row, const std::string& name) { return std::stod(row.at(name)); }

/// Position px, py, pz with the quaternion whose parts have this letter in front (q, or b in the
/// projections).
inline Pose pose(const CsvRow& row, const std::string& letter = "q") {
  return {{number(row, "px"), number(row, "py"), number(row, "pz")},
          {number(row, letter + "w"), number(row, letter + "x"), number(row, letter + "y"),
           number(row, letter + "z")}};
}

inline Joints joints(const CsvRow& row, std::size_t count) {
  Joints q{};
  for (std::size_t i = 0; i < count; ++i) q[i] = number(row, "q" + std::to_string(i + 1));
  return q;
}

struct ArmVectors {
  DhTable table;
  Joints lower_q{}, upper_q{};
};

inline ArmVectors arm_vectors(const std::string& arm) {
  ArmVectors vectors;
  for (const CsvRow& row : read_csv("dh.csv")) {
    if (row.at("arm") != arm) continue;
    const std::size_t i = vectors.table.count++;
    vectors.table.rows.at(i) = {row.at("kind") == "prismatic" ? JointKind::kPrismatic : JointKind::kRotary,
                                number(row, "theta_rad"), number(row, "d_m"), number(row, "a_m"),
                                number(row, "alpha_rad")};
    vectors.lower_q.at(i) = number(row, "q_min");
    vectors.upper_q.at(i) = number(row, "q_max");
  }
  if (vectors.table.count == 0) throw std::runtime_error("no arm " + arm + " in dh.csv");
  for (const CsvRow& row : read_csv("frames.csv")) {
    if (row.at("arm") != arm) continue;
    (row.at("frame") == "base_T_0" ? vectors.table.base_T_0 : vectors.table.n_T_tool) = pose(row);
  }
  return vectors;
}

}  // namespace corbot::test
