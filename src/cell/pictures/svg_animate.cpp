// SPDX-License-Identifier: Apache-2.0
#include "cell/pictures/svg_animate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace corbot::cell {
namespace {

std::string without_zeros(std::string text) {
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string key_time(double share) { return without_zeros(fmt::format("{:.5f}", share)); }

}  // namespace

std::vector<double> values_at(const Track& track, double time_s) {
  const auto next = std::upper_bound(track.begin(), track.end(), time_s,
                                     [](double time, const Key& key) { return time < key.time_s; });
  if (next == track.begin()) return track.front().values;
  const Key& from = *(next - 1);
  if (next == track.end()) return from.values;
  const double share = (time_s - from.time_s) / (next->time_s - from.time_s);
  std::vector<double> values = from.values;
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += share * (next->values[i] - values[i]);
  return values;
}

std::string svg_number(double value) { return without_zeros(fmt::format("{:.1f}", value)); }

std::string svg_text(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&') {
      safe += "&amp;";
    } else if (c == '<') {
      safe += "&lt;";
    } else if (c == '>') {
      safe += "&gt;";
    } else {
      safe += c;
    }
  }
  return safe;
}

double Playback::share(double time_s) const {
  return end_s > begin_s ? std::clamp((time_s - begin_s) / (end_s - begin_s), 0.0, 1.0) : 0;
}

std::string Playback::attributes() const {
  return fmt::format("dur=\"{:.2f}s\" repeatCount=\"indefinite\"", duration_s());
}

Track played(const Track& track, const Playback& playback) {
  Track part{{playback.begin_s, values_at(track, playback.begin_s)}};
  for (const Key& key : track) {
    if (key.time_s > playback.begin_s && key.time_s < playback.end_s) part.push_back(key);
  }
  part.push_back({playback.end_s, values_at(track, playback.end_s)});
  return part;
}

std::string svg_animation(std::string_view tag, const Track& track, const Playback& playback,
                          const Format& format) {
  std::string values;
  std::string times;
  bool has_change = false;
  for (const Key& key : track) {
    const char* const separator = values.empty() ? "" : ";";
    has_change = has_change || key.values != track.front().values;
    values += separator + format(key.values);
    times += separator + key_time(playback.share(key.time_s));
  }
  if (!has_change) return "";
  return fmt::format("<{} {} values=\"{}\" keyTimes=\"{}\"/>", tag, playback.attributes(), values, times);
}

std::string svg_jumps(std::string_view attribute, const std::vector<Jump>& jumps, const Playback& playback) {
  if (jumps.size() < 2) return "";
  std::string values;
  std::string times;
  for (const Jump& jump : jumps) {
    values += (values.empty() ? "" : ";") + jump.value;
    times += times.empty() ? "0" : ";" + key_time(playback.share(jump.time_s));
  }
  return fmt::format("<animate attributeName=\"{}\" calcMode=\"discrete\" {} values=\"{}\" keyTimes=\"{}\"/>",
                     attribute, playback.attributes(), values, times);
}

}  // namespace corbot::cell
