// SPDX-License-Identifier: Apache-2.0
// Reads cell.toml. Reports all faults at once, each with line, key, value and allowed values.
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <map>
#include <set>

#include "cell/camera_file.h"
#include "cell/cell_config.h"
#include "cell/cell_rules.h"
#include "config/load_profile.h"
#include "config/section.h"
#include "state/position_store.h"

namespace corbot::cell {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;

constexpr std::size_t kMostListed = 16;  // places, and robots: bounds of the IDL's sequences
constexpr int kMostSlots = 1000;
constexpr double kLeastPitch_m = 0.04;
constexpr const char* kWidest = "more than the widest piece's diameter, or a square's diagonal";
/// Room between open fingers and the widest piece: play, and the camera's error to either side.
constexpr double kOpenRoom_m = 0.004;
constexpr double kLeastApproachClearance_m = 0.01;
constexpr double kRounding_m = 1e-9;
constexpr double kLeastWaitDistance_m = 0.05;
constexpr double kGraspBelowTop_m = 0.005;
constexpr std::size_t kLongestSocketPath = 107;

std::string name_of(Section& section, std::set<std::string>& taken) {
  const auto name = section.text("name");
  if (!name) return {};
  if (!is_name(*name)) {
    section.refuse("name", "must be " + name_rule());
  } else if (!taken.insert(*name).second) {
    section.refuse("name", "is the name of an earlier table: give each table its own name");
  }
  return *name;
}

class Reader {
 public:
  Reader(const fs::path& file, const CellOverrides& overrides)
      : file_(file), overrides_(overrides), faults_{file.string(), {}} {}

  CellConfig read() {
    try {
      const toml::table table = toml::parse(read_profile_text(file_), faults_.file);
      if (table.contains("joint") && !table.contains("cell"))
        throw ConfigError(
            {{faults_.file, 0, "", "", "is a robot's profile, not a cell file: it has no [cell]", ""}});
      Section root(&table, "", faults_);
      read_cell(root.table("cell"));
      read_kinds(root.tables("kind"));
      read_places(root.tables("place"));
      read_robots(root.tables("robot"));
      check_state_directory();
      read_store(root.table_or_empty("store"), root.has("scene"));
      read_camera_table(root.table("camera"));
      read_reference(root.table_or_empty("coordinator"), cell_.coordinator_reference);
      read_timing(root.table_or_empty("timing"));
      if (root.has("scene")) read_scene(root.table("scene"));
      if (cell_.camera_source == "scene" && cell_.camera_reference.empty() && !root.has("scene"))
        faults_.add(0, "scene", "", "is missing: the camera's source is the scene");
      root.skip("scene");
      root.finish();
      if (faults_.faults.empty()) check_world();
    } catch (const toml::parse_error& error) {
      faults_.add(error.source().begin.line, "", "", fmt::format("not TOML: {}", error.description()));
    }
    if (faults_.faults.empty()) return std::move(cell_);
    std::stable_sort(faults_.faults.begin(), faults_.faults.end(),
                     [](const ConfigFault& a, const ConfigFault& b) { return a.line < b.line; });
    add_names("place", cell_.places);
    add_names("robot", cell_.robots);
    add_names("kind", cell_.kinds);
    throw ConfigError(std::move(faults_.faults));
  }

 private:
  /// Adds to each fault of a table "key[N]" the table's name, unless the fault shows the name as its value.
  template <class Items>
  void add_names(const char* key, const Items& items) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      for (ConfigFault& fault : faults_.faults) {
        if (!is_name(items[i].name) || !fault.key.starts_with(fmt::format("{}[{}].", key, i))) continue;
        if (fault.value != fmt::format("\"{}\"", items[i].name)) fault.name = items[i].name;
      }
    }
  }

  void read_cell(Section section) {
    cell_.name = section.text("name").value_or("");
    if (overrides_.name) {
      cell_.name = *overrides_.name;
      if (!is_name(cell_.name))
        faults_.add(0, "--name", "\"" + shown_text(cell_.name) + "\"", "must be " + name_rule());
    } else if (section.present() && !is_name(cell_.name)) {
      section.refuse("name", "must be " + name_rule());
    }
    cell_.host = section.text_or("host", cell_.host).value_or("");
    cell_.ports = static_cast<int>(section.integer("ports", {1024, 65535, false, ""}).value_or(0));
    if (overrides_.ports) cell_.ports = *overrides_.ports;
    ports_line_ = section.line_of("ports");
    section.finish();
    cell_.state_directory = overrides_.state_directory.empty()
                                ? default_state_directory() / "cells" / cell_.name
                                : overrides_.state_directory;
    cell_.state_directory = fs::absolute(cell_.state_directory).lexically_normal();
  }

  void read_kinds(std::vector<Section> sections) {
    std::set<std::string> taken;
    for (Section& section : sections) {
      Kind kind;
      kind.name = name_of(section, taken);
      if (const auto hue = section.numbers("hue_deg", 2, {0, 360, false, "degrees"}))
        kind.hue_deg = {(*hue)[0], (*hue)[1]};
      kind.saturation_min =
          section.number_or("saturation_min", kind.saturation_min, {0.05, 1, false, ""}).value_or(0);
      kind.value_min = section.number_or("value_min", kind.value_min, {0.05, 1, false, ""}).value_or(0);
      read_width(section, kind);
      kind.label_m = section.number("label_m", {0.002, 0.2, false, "m"}).value_or(0);
      kind.height_m = section.number("height_m", {0.002, 0.5, false, "m"}).value_or(0);
      kind.grasp_m = section.number("grasp_m", {0.001, 0.5, false, "m"}).value_or(0);
      if (kind.width_m > 0 && kind.label_m > kind.width_m)
        section.refuse("label_m", fmt::format("must be at most {}, {} m",
                                              kind.is_square ? "side_m" : "diameter_m", kind.width_m));
      if (kind.height_m > 0 && kind.grasp_m > kind.height_m - kGraspBelowTop_m)
        section.refuse("grasp_m", fmt::format("must be {} m or more below height_m, {} m", kGraspBelowTop_m,
                                              kind.height_m));
      for (const Kind& other : cell_.kinds)
        if (section.has("hue_deg") && share_hue(kind, other))
          section.refuse("hue_deg",
                         fmt::format("must not overlap those of {}: kinds differ by the hue of their label",
                                     other.name));
      tallest_m_ = std::max(tallest_m_, kind.height_m);
      section.finish();
      kind_lines_.push_back(section.line_of("name"));
      cell_.kinds.push_back(kind);
    }
  }

  static void read_width(Section& section, Kind& kind) {
    kind.is_square = section.has("side_m");
    if (section.has("diameter_m") == kind.is_square) {
      section.refuse(kind.is_square ? "side_m" : "name",
                     "needs either diameter_m, for a round piece, or side_m, for a square one");
      for (const char* key : {"diameter_m", "side_m"}) section.skip(key);
      return;
    }
    const char* const key = kind.is_square ? "side_m" : "diameter_m";
    kind.width_m = section.number(key, {0.002, 0.2, false, "m"}).value_or(0);
  }

  void read_places(std::vector<Section> sections) {
    std::set<std::string> taken;
    for (Section& section : sections) {
      Place place;
      place.name = name_of(section, taken);
      if (is_word_of_scene(place.name))
        section.refuse("name", "has another meaning in the simulation's last line: choose another name");
      place.frame = frame(section);
      place.is_shared = section.flag_or("shared", false).value_or(false);
      const bool has_slots = section.has("rows") || section.has("columns") || section.has("pitch_m");
      if (section.has("size_m") == has_slots) {
        section.refuse(section.has("size_m") ? "size_m" : "name",
                       "needs either size_m, for an area, or columns, rows and pitch_m, for slots");
        for (const char* key : {"size_m", "columns", "rows", "pitch_m", "row_kinds"}) section.skip(key);
        place.size_m = Vector2d(0.1, 0.1);
      } else if (has_slots) {
        place.slots = read_slots(section);
        if (section.has("row_kinds")) read_row_kinds(section, place);
      } else {
        place.size_m = vector2(section, "size_m", {0.01, 10, false, "m"});
      }
      section.finish();
      for (const Place& other : cell_.places)
        if (overlap(place, other))
          section.refuse("position_m", "lies over " + other.name + ": move one of them");
      cell_.places.push_back(place);
    }
    check_count("place", cell_.places.size());
  }

  void check_count(const char* key, std::size_t count) {
    if (count > kMostListed)
      faults_.add(0, key, std::to_string(count), fmt::format("at most {}", kMostListed));
  }

  SlotGrid read_slots(Section& section) const {
    SlotGrid grid;
    grid.columns = static_cast<int>(section.integer("columns", {1, kMostSlots, false, ""}).value_or(1));
    grid.rows = static_cast<int>(section.integer("rows", {1, kMostSlots, false, ""}).value_or(1));
    grid.pitch_m = vector2(section, "pitch_m", {kLeastPitch_m, 1, false, "m"});
    if (grid.columns * grid.rows > kMostSlots)
      section.refuse("rows", fmt::format("at most {} slots", kMostSlots));
    const double least_m = widest_m(cell_.kinds) + kRimSpacing_m;
    if (grid.pitch_m.minCoeff() >= kLeastPitch_m && grid.pitch_m.minCoeff() < least_m)
      section.refuse("pitch_m",
                     fmt::format("must be at least {:.6g} m, {} m {}", least_m, kRimSpacing_m, kWidest));
    return grid;
  }

  void read_row_kinds(Section& section, Place& place) {
    const auto kinds = section.texts("row_kinds", kMostSlots);
    if (!kinds) return;
    if (kinds->size() != static_cast<std::size_t>(place.slots->rows))
      return section.refuse("row_kinds", fmt::format("has {} names: must have one for each of the {} rows",
                                                     kinds->size(), place.slots->rows));
    for (const std::string& kind : *kinds)
      if (cell_.kind(kind) == nullptr)
        return section.refuse("row_kinds",
                              fmt::format("must have kinds of this file: {} is none", shown_text(kind)));
    place.row_kinds = *kinds;
  }

  void read_robots(std::vector<Section> sections) {
    std::set<std::string> taken;
    for (Section& section : sections) {
      CellRobot robot;
      robot.name = name_of(section, taken);
      robot.frame = frame(section);
      read_address(section, robot);
      robot.from = read_place_name(section, "from");
      robot.to = read_place_name(section, "to");
      if (!robot.from.empty() && robot.from == robot.to)
        section.refuse("to", "must be another place than from");
      const Place* to = cell_.place(robot.to);
      if (to != nullptr && !to->slots) section.refuse("to", "must be a place with slots");
      read_motion(section, robot);
      section.finish();
      cell_.robots.push_back(robot);
      use_places(section, cell_.robots.back());
    }
    check_count("robot", cell_.robots.size());
    check_ports();
  }

  void read_address(Section& section, CellRobot& robot) {
    if (is_name(robot.name) && is_name(cell_.name) && !is_name(cell_.robot_name(robot))) {
      section.refuse("name",
                     fmt::format("is {} on this machine, of {} characters; {} are allowed",
                                 cell_.robot_name(robot), cell_.robot_name(robot).size(), kMaxNameLength));
    }
    if (section.has("profile") == section.has("reference")) {
      section.refuse(section.has("profile") ? "profile" : "name",
                     "needs either profile, for a robot that the cell starts, or reference, for one that "
                     "runs elsewhere");
      for (const char* key : {"profile", "reference", "scene_profile", "orb"}) section.skip(key);
      return;
    }
    if (section.has("reference")) {
      robot.reference = read_uri(section);
      if (section.has("scene_profile")) robot.scene_profile = read_file(section, "scene_profile");
      return;
    }
    robot.profile = read_file(section, "profile");
    robot.orb = section.text_or("orb", robot.orb).value_or("");
    if (robot.orb != "omniorb" && robot.orb != "orbit2")
      section.refuse("orb", "must be \"omniorb\" or \"orbit2\"");
  }

  fs::path read_file(Section& section, std::string_view key) const {
    fs::path file = file_.parent_path() / section.text(key).value_or("");
    std::error_code error;
    if (!fs::is_regular_file(file, error)) section.refuse(key, "there is no such file");
    return file;
  }

  static std::string read_uri(Section& section) {
    const auto uri = section.text("reference");
    if (uri && !is_reference(*uri)) section.refuse("reference", kReferenceRule);
    return uri.value_or("");
  }

  /// Checks the directory's path, which is part of the robots' profiles and of socket paths.
  void check_state_directory() {
    const std::string directory = cell_.state_directory.string();
    if (has_special_character(directory))
      faults_.add(0, "--state-dir", shown_text(directory),
                  "must be a path without \", \\, $ and control characters");
    const std::string socket = longest_socket(cell_).string();
    if (socket.size() > kLongestSocketPath)
      faults_.add(0, "--state-dir", shown_text(socket),
                  fmt::format("this socket's path has {} bytes, at most {}: choose a shorter directory",
                              socket.size(), kLongestSocketPath));
  }

  std::string read_place_name(Section& section, std::string_view key) {
    std::string name = section.text(key).value_or("");
    if (!name.empty() && cell_.place(name) == nullptr) {
      std::string names;
      for (const Place& place : cell_.places) names += (names.empty() ? "" : ", ") + place.name;
      section.refuse(key, "must be a place of this file: " + names);
    }
    return name;
  }

  void read_motion(Section& section, CellRobot& robot) {
    robot.wait_m = vector3(section, "wait_m");
    robot.above_m = section.number_or("above_m", robot.above_m, {0, 1, false, "m"}).value_or(0);
    if (section.present() && robot.above_m < tallest_m_ + kLeastApproachClearance_m - kRounding_m)
      section.refuse("above_m",
                     fmt::format("must be at least {} m, the tallest piece and {} m",
                                 tallest_m_ + kLeastApproachClearance_m, kLeastApproachClearance_m));
    robot.approach_m_s =
        section.number_or("approach_m_s", robot.approach_m_s, {0.001, 10, false, "m/s"}).value_or(1);
    robot.speed_percent =
        section.number_or("speed_percent", robot.speed_percent, {0, 100, true, "percent"}).value_or(1);
    robot.settle_s = section.number_or("settle_s", robot.settle_s, {0, 10, false, "s"}).value_or(0);
    robot.opening_m = section.number_or("opening_m", robot.opening_m, {0.001, 1, false, "m"}).value_or(0);
    const double least_m = widest_m(cell_.kinds) + kOpenRoom_m;
    if (robot.opening_m > 0 && robot.opening_m < least_m)
      section.refuse("opening_m",
                     fmt::format("must be at least {:.6g} m, {} m {}", least_m, kOpenRoom_m, kWidest));
    robot.transit = section.text_or("transit", robot.transit).value_or("");
    if (robot.transit != "free" && robot.transit != "arc")
      section.refuse("transit", "must be \"free\" or \"arc\"");
    for (const Place& place : cell_.places) {
      const bool is_near = place.is_shared && place.covers(robot.wait_m, kLeastWaitDistance_m);
      if (section.has("wait_m") && (is_near || place.covers(robot.wait_m)))
        section.refuse("wait_m",
                       fmt::format("must not be over a place, and {} m or more from a shared one: {}",
                                   kLeastWaitDistance_m, place.name));
    }
  }

  /// Two robots may use one place only if the place is shared, so that its zone keeps them apart.
  void use_places(const Section& section, const CellRobot& robot) {
    for (const auto& [key, name] : {std::pair{"from", robot.from}, {"to", robot.to}}) {
      const Place* place = cell_.place(name);
      if (place == nullptr) continue;
      const auto [first, is_new] = users_.emplace(name, robot.name);
      if (!is_new && first->second != robot.name && !place->is_shared)
        faults_.add(
            section.line_of(key), section.full_key(key), fmt::format("\"{}\"", name),
            fmt::format("is also used by {}: a place of two robots must have shared = true", first->second));
    }
  }

  void check_ports() {
    int last = cell_.ports + 2;
    for (const CellRobot& robot : cell_.robots) last += robot.profile.empty() ? 0 : 1;
    if (cell_.ports >= 1024 && last <= 65535) return;
    if (cell_.ports == 0) return;  // the fault is reported already
    const bool is_option = overrides_.ports.has_value();
    faults_.add(is_option ? 0 : ports_line_, is_option ? "--ports" : "cell.ports",
                std::to_string(cell_.ports),
                fmt::format("must be from 1024 to {}: {} ports in a row are needed",
                            65535 - (last - cell_.ports), last - cell_.ports + 1));
  }

  static void read_reference(Section section, std::string& reference) {
    section.skip("reference");
    if (section.has("reference")) reference = read_uri(section);
    section.finish();
  }

  void read_store(Section section, bool is_simulated) {
    cell_.ledger = section.text_or("ledger", "ledger.db").value_or("");
    if (section.has("ledger") && section.has("reference"))
      section.refuse("reference",
                     "must not be given together with ledger: the store runs either here or elsewhere");
    if (is_simulated && section.has("ledger") && !is_plain_file_name(cell_.ledger))
      section.refuse(
          "ledger",
          "must be a plain file name, in the state directory: a simulated cell begins anew at each run");
    if (cell_.ledger.is_relative()) cell_.ledger = cell_.state_directory / cell_.ledger;
    read_reference(std::move(section), cell_.store_reference);
  }

  void read_camera_table(Section section) {
    if (section.has("reference")) {
      read_reference(std::move(section), cell_.camera_reference);
      return;
    }
    section.skip("reference");
    cell_.camera_source = section.text("source").value_or("scene");
    if (cell_.camera_source != "scene") section.refuse("source", "must be \"scene\"");
    cell_.camera = camera_file(section, "calibration");
    calibration_line_ = section.line_of("calibration");
    section.finish();
  }

  CameraModel camera_file(Section& section, std::string_view key) {
    const auto name = section.text(key);
    std::error_code error;
    if (!name) return {};
    const fs::path file = file_.parent_path() / *name;
    if (fs::is_regular_file(file, error)) return read_camera(file, faults_.faults).value_or(CameraModel{});
    section.refuse(key, "there is no such file");
    return {};
  }

  /// Checks the rules that need a description without other faults.
  void check_world() {
    for (std::size_t i = 0; i < cell_.kinds.size(); ++i)
      if (const std::string place = place_that_keeps(cell_, cell_.kinds[i]); !place.empty())
        faults_.add(kind_lines_[i], fmt::format("kind[{}].name", i),
                    fmt::format("\"{}\"", cell_.kinds[i].name),
                    fmt::format("no robot brings this kind from {} on: name it in row_kinds", place));
    if (cell_.camera_reference.empty()) {
      if (const std::string names = unseen_places(cell_); !names.empty())
        faults_.add(calibration_line_, "camera.calibration", "",
                    "the camera must show the whole of each place: " + names + " is cut off");
    }
    if (!cell_.scene) return;
    const auto [columns, rows] = cell_.scene->lens.size_px;
    if (cell_.camera_reference.empty() && cell_.scene->lens.size_px != cell_.camera.size_px)
      faults_.add(lens_line_, "scene.lens", "",
                  fmt::format("has {} x {} pixels, the calibration has {} x {}: they must be the same",
                              columns, rows, cell_.camera.size_px[0], cell_.camera.size_px[1]));
    if (const std::string why = fault_of_pieces(cell_, cell_.scene->pieces); !why.empty()) {
      const bool is_option = overrides_.pieces.has_value();
      faults_.add(is_option ? 0 : pieces_line_, is_option ? "--pieces" : "scene.pieces",
                  std::to_string(cell_.scene->pieces), why);
    }
  }

  void read_timing(Section section) {
    Timing& timing = cell_.timing;
    timing.look_s = section.number_or("look_s", timing.look_s, {0.1, 60, false, "s"}).value_or(1);
    timing.motion_s = section.number_or("motion_s", timing.motion_s, {1, 3600, false, "s"}).value_or(1);
    timing.attempts =
        static_cast<int>(section.integer_or("attempts", timing.attempts, {1, 100, false, ""}).value_or(1));
    section.finish();
  }

  void read_scene(Section section) {
    SceneOptions scene;
    scene.pieces =
        static_cast<int>(section.integer_or("pieces", scene.pieces, {0, 100, false, "pieces"}).value_or(0));
    if (overrides_.pieces) scene.pieces = *overrides_.pieces;
    scene.seed =
        static_cast<std::uint64_t>(section.integer_or("seed", 1, {0, 4294967295.0, false, ""}).value_or(1));
    if (overrides_.seed) scene.seed = *overrides_.seed;
    scene.noise = section.number_or("noise", scene.noise, {0, 50, false, "(of 255)"}).value_or(0);
    scene.lens = camera_file(section, "lens");
    pieces_line_ = section.line_of(section.has("pieces") ? "pieces" : "lens");
    lens_line_ = section.line_of("lens");
    section.finish();
    cell_.scene = scene;
  }

  fs::path file_;
  CellOverrides overrides_;
  FaultList faults_;
  CellConfig cell_;
  std::vector<std::uint32_t> kind_lines_;
  std::uint32_t ports_line_{0};
  std::uint32_t calibration_line_{0};
  std::uint32_t pieces_line_{0};
  std::uint32_t lens_line_{0};
  double tallest_m_{0};
  std::map<std::string, std::string> users_;  ///< place -> the first robot there
};

}  // namespace

CellConfig load_cell(const fs::path& file, const CellOverrides& overrides) {
  return Reader(file, overrides).read();
}

}  // namespace corbot::cell
