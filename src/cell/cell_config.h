// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "cell/camera_model.h"
#include "cell/frames.h"
#include "config/profile.h"

// The description of a cell, cell.toml, as all of its programs read it. Inside: metres, radians, seconds; the world frame, z vertical.

namespace corbot::cell {

/// Slots in rows; slot n is in column n % columns and row n / columns. Columns run along the place's x, rows along its y.
struct SlotGrid {
  int columns{};
  int rows{};
  Eigen::Vector2d pitch_m{};
  [[nodiscard]] int count() const { return columns * rows; }
};

/// A piece whose foot is seen so far over a place's edge, or above or below its surface, still stands on it: a picture and a
/// servo are not exact.
inline constexpr double kOnPlace_m = 0.015;

/// `place`: an area, where pieces lie anywhere, or slots.
struct Place {
  std::string name;
  UprightFrame frame;                     ///< its middle, on the surface
  std::optional<Eigen::Vector2d> size_m;  ///< an area's
  std::optional<SlotGrid> slots;
  bool is_shared{false};  ///< several robots reach it; one at a time is in its zone

  /// The middle of a slot, on the surface.
  [[nodiscard]] Eigen::Vector3d slot_position(int slot) const;
  /// Whether a point is over it, `margin_m` beyond its edge included. Slots reach half a pitch beyond the outer ones.
  [[nodiscard]] bool covers(const Eigen::Vector3d& point, double margin_m = 0) const;
  /// Whether a piece with its foot there stands on it, within kOnPlace_m of its edge and of its surface.
  [[nodiscard]] bool carries(const Eigen::Vector3d& foot) const;
  /// Half of its extent along its own x and y.
  [[nodiscard]] Eigen::Vector2d half_size_m() const;
};

/// `robot`.
struct CellRobot {
  std::string name;
  std::filesystem::path profile;  ///< of a robot that the cell starts; empty: it runs elsewhere
  std::string reference;          ///< of one that runs elsewhere: corbaloc or corbaname
  std::filesystem::path
      scene_profile;           ///< of such a robot: its arm and controller in the simulation; may be empty
  std::string orb{"omniorb"};  ///< or "orbit2"
  UprightFrame frame;          ///< in which its Move takes points
  std::string from;            ///< the places that it takes from and brings to
  std::string to;
  Eigen::Vector3d wait_m{};   ///< the tool waits here: out of every zone, over no place
  double above_m{0.06};       ///< it approaches from so far above
  double approach_m_s{0.25};  ///< speed of the way down and up
  double speed_percent{100};  ///< of its profile's, (0, 100]
  double settle_s{0.1};       ///< at rest before the gripper closes or opens
  double opening_m{0.032};    ///< between the open fingers

  /// Of the arm that the scene simulates; empty: none.
  [[nodiscard]] const std::filesystem::path& simulated_profile() const {
    return profile.empty() ? scene_profile : profile;
  }
};

/// `kind`: pieces are upright cylinders with a coloured label on top.
struct Kind {
  std::string name;
  std::array<double, 2>
      hue_deg{};  ///< from the first upward to the second, through 0 where that is smaller; 0 to 360
  double saturation_min{0.45};  ///< 0 … 1
  double value_min{0.25};       ///< 0 … 1
  double label_m{};             ///< diameter of the label
  double diameter_m{};
  double height_m{};
  double grasp_m{};  ///< of the tool centre point over the foot
};

/// `timing`.
struct Timing {
  double look_s{5};     ///< for one look of the camera
  double motion_s{60};  ///< for one motion
  int attempts{3};      ///< failed picks in a row that end the work
};

/// `scene`: simulation only.
struct SceneOptions {
  int pieces{12};
  std::uint64_t seed{1};
  double noise{4};     ///< of a picture's values, 1 sigma, of 255
  CameraModel lens{};  ///< the true camera
};

struct CellConfig {
  std::string name;
  std::string host{"127.0.0.1"};
  int ports{};  ///< the first one; see the functions below
  std::filesystem::path state_directory;
  std::filesystem::path ledger;        ///< of the store that the cell starts
  std::string store_reference;         ///< of one that runs elsewhere; empty: here
  std::string camera_reference;        ///< the same of the camera
  std::string coordinator_reference;   ///< and of the coordinator
  std::string camera_source{"scene"};  ///< the only one so far
  CameraModel camera;
  std::vector<Place> places;
  std::vector<CellRobot> robots;
  std::vector<Kind> kinds;
  Timing timing;
  std::optional<SceneOptions> scene;

  [[nodiscard]] const Place* place(const std::string& name) const;
  [[nodiscard]] const CellRobot* robot(const std::string& name) const;
  [[nodiscard]] const Kind* kind(const std::string& name) const;
  /// The key of one of its places or robots in cell.toml: "place[2]".
  [[nodiscard]] std::string key_of(const Place& place) const;
  [[nodiscard]] std::string key_of(const CellRobot& robot) const;
  /// A place to which a robot brings, and from which none takes: pieces that arrive there are done.
  [[nodiscard]] bool is_last(const Place& place) const;

  /// How a client reaches them: a corbaloc, or the reference that the file names.
  [[nodiscard]] std::string store_uri() const;
  [[nodiscard]] std::string camera_uri() const;
  [[nodiscard]] std::string coordinator_uri() const;
  [[nodiscard]] std::string robot_uri(const CellRobot& robot) const;
  [[nodiscard]] int store_port() const { return ports; }
  [[nodiscard]] int camera_port() const { return ports + 1; }
  [[nodiscard]] int coordinator_port() const { return ports + 2; }
  /// Robots with a profile have the ports from ports + 3 on, in their order.
  [[nodiscard]] int robot_port(const CellRobot& robot) const;
  /// A name on this machine that no robot of another cell has: CELL-ROBOT.
  [[nodiscard]] std::string robot_name(const CellRobot& robot) const { return name + "-" + robot.name; }
  /// Unix sockets of the scene: a servo controller's line, and the picture.
  [[nodiscard]] std::filesystem::path servo_socket(const CellRobot& robot) const;
  [[nodiscard]] std::filesystem::path picture_socket() const { return state_directory / "picture.sock"; }
  /// Where the coordinator keeps a Pause and a Stop; empty without a directory.
  [[nodiscard]] std::filesystem::path hold_file() const {
    return state_directory.empty() ? state_directory : state_directory / "hold";
  }
  /// What each robot does, a line for each change: activity.h.
  [[nodiscard]] std::filesystem::path activity_file() const { return state_directory / "activity.jsonl"; }
};

/// Object keys of the cell's own objects.
inline constexpr const char* kStoreKey = "Store";
inline constexpr const char* kCameraKey = "Camera";
inline constexpr const char* kCoordinatorKey = "Coordinator";

/// In place of what the file says.
struct CellOverrides {
  std::optional<std::string> name;
  std::optional<int> ports;
  std::filesystem::path state_directory;  ///< empty: cells/NAME below corbot's own
  std::optional<int> pieces;
  std::optional<std::uint64_t> seed;
};

/// Reads and checks a cell. Throws ConfigError with all faults: line, key, value and what is allowed.
[[nodiscard]] CellConfig load_cell(const std::filesystem::path& file, const CellOverrides& overrides = {});

}  // namespace corbot::cell
