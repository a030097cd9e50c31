// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cell/cell_config.h"
#include "cli/cell/work_history.h"

namespace corbot::cli {

/// The scene's counts at its end, from its last line: "end pallet1=0 ... nearest_mm=55.2".
struct SceneEnd {
  std::map<std::string, int> standing;  ///< place -> pieces; also "elsewhere" and "held"
  int fallen{};
  int touches{};
  std::optional<double> nearest_mm;  ///< between two arms; nothing if there is one arm
  int overruns{};                    ///< late ticks of the simulation
};

/// Returns nothing if the line is not the scene's, or a number is missing.
[[nodiscard]] std::optional<SceneEnd> parse_scene_end(std::string_view line);

/// The findings of three sources at the end of the work. The key "" of `seen` counts sightings over no place.
struct CellEnd {
  std::optional<int> expected;  ///< pieces at the beginning of the work; nothing if not known
  std::map<std::string, int> in_ledger;
  std::map<std::uint64_t, int> arrivals;  ///< piece -> number of times that it was placed at a last place
  std::map<std::string, int> seen;
  bool has_scene{false};
  std::optional<SceneEnd> scene;
  std::vector<std::uint8_t> camera_jpeg;  ///< last picture, marked; empty if the camera has none
  WorkHistory history;
  std::map<std::string, std::uint64_t> overruns;  ///< robot -> late cycles; only for robots that count them
};

struct Verdict {
  std::string summary;
  std::vector<std::string> faults;  ///< disagreements; empty: all pieces are at their places
};

/// Compares ledger, camera and scene. Each piece must be at a place from which no robot takes, exactly once.
[[nodiscard]] Verdict judge(const cell::CellConfig& cell, const CellEnd& end);

}  // namespace corbot::cli
