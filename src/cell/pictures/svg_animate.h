// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "cell/pictures/track.h"

// Functions for the text of an SVG and of its animations (SMIL), which need no script.

namespace corbot::cell {

/// Returns the value rounded to a tenth, without superfluous zeros: "12", "-0.5".
[[nodiscard]] std::string svg_number(double value);
/// Returns the text with XML's special characters escaped.
[[nodiscard]] std::string svg_text(std::string_view text);

/// The time span that an animation shows, and the speed. The animation repeats forever.
struct Playback {
  double begin_s{};
  double end_s{};
  double factor{1};
  [[nodiscard]] double share(double time_s) const;
  /// Returns the attributes of each animation: "dur=... repeatCount=...".
  [[nodiscard]] std::string attributes() const;
  [[nodiscard]] double duration_s() const { return (end_s - begin_s) / factor; }
};

/// Returns a track's values at a time. If two keys have one time, the second applies from that time.
[[nodiscard]] std::vector<double> values_at(const Track& track, double time_s);

/// Returns the part of a track within the playback, with keys at begin and end.
[[nodiscard]] Track played(const Track& track, const Playback& playback);

using Format = std::function<std::string(const std::vector<double>& values)>;

/// Returns an element `tag`, "animate attributeName=...", for a track from played(). Empty if no value
/// changes.
[[nodiscard]] std::string svg_animation(std::string_view tag, const Track& track, const Playback& playback,
                                        const Format& format);

/// A value that jumps.
struct Jump {
  double time_s{};
  std::string value;
};
/// Returns an element with discrete values. The first value applies from the beginning. Empty without a jump.
[[nodiscard]] std::string svg_jumps(std::string_view attribute, const std::vector<Jump>& jumps,
                                    const Playback& playback);

}  // namespace corbot::cell
