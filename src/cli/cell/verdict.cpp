// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/verdict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "client/number.h"

namespace corbot::cli {
namespace {

constexpr const char* kElsewhere = "elsewhere";

std::string pieces(int count) { return fmt::format("{} piece{}", count, count == 1 ? "" : "s"); }

/// Compares the counts of one source with the expected ones: all pieces at last places, none elsewhere.
class Count {
 public:
  Count(const cell::CellConfig& cell, const std::map<std::string, int>& by_place) {
    for (const auto& [name, count] : by_place) {
      const cell::Place* place = cell.place(name);
      if (place != nullptr && cell.is_last(*place)) {
        last_ += count;
      } else if (count > 0) {
        others_ += count;
        where_ += fmt::format("{}{} {}", where_.empty() ? "" : ", ", pieces(count),
                              place != nullptr ? "on " + name
                              : name.empty()   ? kElsewhere
                                               : name);
      }
    }
  }
  [[nodiscard]] int last() const { return last_; }
  [[nodiscard]] int others() const { return others_; }

  void compare(const char* witness, int expected, const std::string& last_names,
               std::vector<std::string>& faults) const {
    if (last_ != expected)
      faults.push_back(fmt::format("{} {} on {}, not {}", witness, pieces(last_), last_names, expected));
    if (others_ > 0) faults.push_back(fmt::format("{} {}", witness, where_));
  }

 private:
  int last_{0};
  int others_{0};
  std::string where_;
};

std::string scene_summary(const SceneEnd& scene) {
  const std::string nearest =
      scene.nearest_mm ? fmt::format("arms never nearer than {:.0f} mm, ", *scene.nearest_mm) : "";
  return fmt::format("; {}{} touches, {} fallen", nearest, scene.touches, scene.fallen);
}

void judge_scene(const cell::CellConfig& cell, const std::optional<SceneEnd>& scene, int expected,
                 const std::string& last_names, Verdict& verdict) {
  if (!scene) {
    verdict.faults.emplace_back("the scene reported no counts at its end");
    return;
  }
  verdict.summary += scene_summary(*scene);
  Count(cell, scene->standing).compare("the scene has", expected, last_names, verdict.faults);
  if (scene->fallen > 0) verdict.faults.push_back(fmt::format("{} fell", pieces(scene->fallen)));
  if (scene->touches > 0)
    verdict.faults.push_back(
        fmt::format("the arms touched {} time{}", scene->touches, scene->touches == 1 ? "" : "s"));
}

}  // namespace

std::optional<SceneEnd> parse_scene_end(std::string_view line) {
  SceneEnd end;
  constexpr std::string_view kBegin = "end ";
  if (!line.starts_with(kBegin)) return std::nullopt;
  std::string_view rest = line.substr(kBegin.size());
  bool has_counts = false;
  while (!rest.empty()) {
    const std::string_view word = rest.substr(0, rest.find(' '));
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
    const std::size_t equals = word.find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    const std::string key(word.substr(0, equals));
    const std::string text(word.substr(equals + 1));
    const auto value = client::parse_number(text);
    if (key == "nearest_mm") {
      if (text != "-" && !value) return std::nullopt;
      end.nearest_mm = value;
      has_counts = true;
      continue;
    }
    if (!value || *value < 0 || *value > 1e6) return std::nullopt;
    const int count = static_cast<int>(*value);
    if (key == "fallen") {
      end.fallen = count;
    } else if (key == "touches") {
      end.touches = count;
    } else if (key == "overruns") {
      end.overruns = count;
    } else {
      end.standing[key] = count;
    }
  }
  return has_counts ? std::optional(end) : std::nullopt;
}

Verdict judge(const cell::CellConfig& cell, const CellEnd& end) {
  std::vector<std::string> names;
  for (const cell::Place& place : cell.places) {
    if (cell.is_last(place)) names.push_back(place.name);
  }
  const std::string last_names = fmt::format("{}", fmt::join(names, ", "));
  const Count ledger(cell, end.in_ledger);
  const Count camera(cell, end.seen);
  const int expected = end.expected.value_or(ledger.last());
  Verdict verdict;
  ledger.compare("the ledger has", expected, last_names, verdict.faults);
  bool is_each_once = static_cast<int>(end.arrivals.size()) == ledger.last();
  if (!is_each_once)
    verdict.faults.push_back(fmt::format("{} arrived on {} by the ledger's events, not {}",
                                         pieces(static_cast<int>(end.arrivals.size())), last_names,
                                         ledger.last()));
  for (const auto& [piece, times] : end.arrivals) {
    if (times == 1) continue;
    is_each_once = false;
    verdict.faults.push_back(fmt::format("piece {} arrived {} times", piece, times));
  }
  verdict.summary =
      fmt::format("{} of {} pieces on {}{}; the camera sees {} there, {} elsewhere", ledger.last(), expected,
                  last_names, is_each_once ? ", each once" : "", camera.last(), camera.others());
  camera.compare("the camera sees", expected, last_names, verdict.faults);
  if (end.has_scene) judge_scene(cell, end.scene, expected, last_names, verdict);
  return verdict;
}

}  // namespace corbot::cli
