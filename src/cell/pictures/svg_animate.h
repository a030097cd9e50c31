// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "cell/pictures/track.h"

// Text of an SVG and of its animations (SMIL), which need no script.

namespace corbot::cell {

/// To a tenth, without what a reader does not need: "12", "-0.5".
[[nodiscard]] std::string svg_number(double value);
/// With the characters replaced that XML keeps for itself.
[[nodiscard]] std::string svg_text(std::string_view text);

/// The time that an animation shows, and how fast. It repeats for ever.
struct Playback {
  double begin_s{};
  double end_s{};
  double factor{1};
  [[nodiscard]] double share(double time_s) const;
  /// For each animation: "dur=... repeatCount=...".
  [[nodiscard]] std::string attributes() const;
  [[nodiscard]] double duration_s() const { return (end_s - begin_s) / factor; }
};

/// Of two keys at one time the later one holds from there on.
[[nodiscard]] std::vector<double> values_at(const Track& track, double time_s);

/// The part of a track that is played, with keys at its begin and end.
[[nodiscard]] Track played(const Track& track, const Playback& playback);

using Format = std::function<std::string(const std::vector<double>& values)>;

/// An element `tag`, "animate attributeName=...", for a track that is played already. Empty where nothing
/// changes.
[[nodiscard]] std::string svg_animation(std::string_view tag, const Track& track, const Playback& playback,
                                        const Format& format);

/// A value that jumps.
struct Jump {
  double time_s{};
  std::string value;
};
/// The first one holds from the beginning on.
[[nodiscard]] std::string svg_jumps(std::string_view attribute, const std::vector<Jump>& jumps,
                                    const Playback& playback);

}  // namespace corbot::cell
