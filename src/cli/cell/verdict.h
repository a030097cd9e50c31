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

/// The scene's counts at its end, as its last line has them: "end pallet1=0 ... nearest_mm=55.2".
struct SceneEnd {
  std::map<std::string, int> standing;  ///< place -> pieces; "elsewhere" and "held" too
  int fallen{};
  int touches{};
  std::optional<double> nearest_mm;  ///< between two arms; nothing where there is one
  int overruns{};                    ///< ticks of the simulation that came late
};

/// Nothing where the line is none of the scene's, or a number is missing.
[[nodiscard]] std::optional<SceneEnd> parse_scene_end(std::string_view line);

/// The findings of three witnesses when the work had ended. The key "" of `seen` counts sightings over no place.
struct CellEnd {
  std::optional<int> expected;  ///< pieces that the work began with; nothing where that is not known
  std::map<std::string, int> in_ledger;
  std::map<std::uint64_t, int> arrivals;  ///< piece -> how often it was placed at a last place
  std::map<std::string, int> seen;
  bool has_scene{false};
  std::optional<SceneEnd> scene;
  std::vector<std::uint8_t> camera_jpeg;  ///< of the last look, marked; empty where the camera gives none
  WorkHistory history;
  std::map<std::string, std::uint64_t>
      overruns;  ///< robot -> cycles that came late; only of robots that count them
};

struct Verdict {
  std::string summary;
  std::vector<std::string> faults;  ///< what disagrees; empty: all pieces are where they belong
};

/// Compares ledger, camera and scene. Pieces belong at the places from which no robot takes, each once.
[[nodiscard]] Verdict judge(const cell::CellConfig& cell, const CellEnd& end);

}  // namespace corbot::cli
