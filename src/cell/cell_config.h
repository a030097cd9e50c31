// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "cell/camera_model.h"
#include "cell/frames.h"
#include "config/profile.h"

// The description of a cell, cell.toml, that all programs of the cell read. Units are metres, radians and
// seconds. Poses are in the world frame, whose z is vertical.

namespace corbot::cell {

/// Slots in rows. Slot n is in column n % columns and row n / columns. The column number rises along the
/// place's x, the row number along its y.
struct SlotGrid {
  int columns{};
  int rows{};
  Eigen::Vector2d pitch_m{};
  [[nodiscard]] int count() const { return columns * rows; }
};

/// The tolerance for a piece on a place: its foot may be seen so far beyond the edge, or above or below the
/// surface. Pictures and servos are not exact.
inline constexpr double kOnPlace_m = 0.015;

/// The table `place`: an area, where a piece may stand anywhere, or slots.
struct Place {
  std::string name;
  UprightFrame frame;                     ///< origin: middle of the place, on the surface
  std::optional<Eigen::Vector2d> size_m;  ///< size of an area
  std::optional<SlotGrid> slots;
  bool is_shared{false};                 ///< several robots may use it; its zone admits one at a time
  std::vector<std::string> row_kinds{};  ///< kind of each row of slots; empty: all rows take every kind

  /// Tells if a piece of a kind may be brought to the slot.
  [[nodiscard]] bool slot_takes(int slot, const std::string& kind) const;
  /// Tells if a piece of a kind may stand at a point over the place.
  [[nodiscard]] bool takes_at(const Eigen::Vector3d& point, const std::string& kind) const;
  /// Tells if a slot takes pieces of a kind. An area takes every kind.
  [[nodiscard]] bool takes(const std::string& kind) const;

  /// Returns the middle of a slot on the surface.
  [[nodiscard]] Eigen::Vector3d slot_position(int slot) const;
  /// Tells if a point is over the place, or at most `margin_m` beyond its edge. The edge of a place with
  /// slots is half a pitch beyond the outer slots.
  [[nodiscard]] bool covers(const Eigen::Vector3d& point, double margin_m = 0) const;
  /// Tells if a piece with that foot stands on the place, with the tolerance kOnPlace_m.
  [[nodiscard]] bool carries(const Eigen::Vector3d& foot) const;
  /// Returns half of the extent along the place's own x and y.
  [[nodiscard]] Eigen::Vector2d half_size_m() const;
};

/// The table `robot`.
struct CellRobot {
  std::string name;
  std::filesystem::path profile;        ///< profile of a robot that the cell starts; empty: it runs elsewhere
  std::string reference;                ///< of a robot that runs elsewhere: corbaloc or corbaname
  std::filesystem::path scene_profile;  ///< simulated arm and controller of a robot elsewhere; may be empty
  std::string orb{"omniorb"};           ///< or "orbit2"
  UprightFrame frame;                   ///< frame of the points of its Move
  std::string from;                     ///< name of the place from which it takes
  std::string to;                       ///< name of the place to which it brings
  Eigen::Vector3d wait_m{};             ///< wait position of the tool: outside of every zone and place
  double above_m{0.06};                 ///< height of the approach above a point
  double approach_m_s{0.25};            ///< speed of the way down and up
  double speed_percent{100};            ///< percent of the profile's speed, (0, 100]
  double settle_s{0.1};                 ///< rest before the gripper moves
  double opening_m{0.032};              ///< distance between the open fingers
  std::string transit{"free"};          ///< or "arc": motions between wait pose and places without a zone

  /// Tells if the robot moves on an arc between its wait pose and the approach above the place.
  [[nodiscard]] bool moves_on_arc(const Place& place) const { return transit == "arc" && !place.is_shared; }
  /// Returns the profile of the arm that the scene simulates; empty: none.
  [[nodiscard]] const std::filesystem::path& simulated_profile() const {
    return profile.empty() ? scene_profile : profile;
  }
};

/// The table `kind`: pieces are upright cylinders or square prisms with a coloured label of the same shape on
/// top.
struct Kind {
  std::string name;
  std::array<double, 2>
      hue_deg{};  ///< 0 to 360, from the first up to the second; passes 0 if the second is smaller
  double saturation_min{0.45};  ///< 0 … 1
  double value_min{0.25};       ///< 0 … 1
  bool is_square{false};
  double label_m{};  ///< label's diameter, or side of a square
  double width_m{};  ///< piece's diameter, or side of a square
  double height_m{};
  double grasp_m{};  ///< height of the tool centre point over the foot

  /// Returns the diameter of the circle around an outline of this width: a square turned by any yaw is
  /// within it.
  [[nodiscard]] double circle_m(double outline_m) const {
    return is_square ? std::numbers::sqrt2 * outline_m : outline_m;
  }
};

/// The table `timing`.
struct Timing {
  double look_s{5};     ///< time-out of one look of the camera
  double motion_s{60};  ///< time-out of one motion
  int attempts{3};      ///< consecutive failed picks that end the work
};

/// The table `scene`, for simulation only.
struct SceneOptions {
  int pieces{12};
  std::uint64_t seed{1};
  double noise{4};     ///< noise of a picture's values, 1 sigma, of 255
  CameraModel lens{};  ///< the true camera
};

struct CellConfig {
  std::string name;
  std::string host{"127.0.0.1"};
  int ports{};  ///< first port; the functions below return the others
  std::filesystem::path state_directory;
  std::filesystem::path ledger;        ///< ledger of the store that the cell starts
  std::string store_reference;         ///< of a store that runs elsewhere; empty: this cell starts the store
  std::string camera_reference;        ///< of a camera that runs elsewhere
  std::string coordinator_reference;   ///< of a coordinator that runs elsewhere
  std::string camera_source{"scene"};  ///< the only source
  CameraModel camera;
  std::vector<Place> places;
  std::vector<CellRobot> robots;
  std::vector<Kind> kinds;
  Timing timing;
  std::optional<SceneOptions> scene;

  [[nodiscard]] const Place* place(const std::string& name) const;
  [[nodiscard]] const CellRobot* robot(const std::string& name) const;
  [[nodiscard]] const Kind* kind(const std::string& name) const;
  /// Returns the key of a place or robot in cell.toml: "place[2]".
  [[nodiscard]] std::string key_of(const Place& place) const;
  [[nodiscard]] std::string key_of(const CellRobot& robot) const;
  /// Tells if a robot brings pieces to the place and no robot takes them: they are finished there.
  [[nodiscard]] bool is_last(const Place& place) const;

  /// Return the reference for clients: a corbaloc, or the reference in the file.
  [[nodiscard]] std::string store_uri() const;
  [[nodiscard]] std::string camera_uri() const;
  [[nodiscard]] std::string coordinator_uri() const;
  [[nodiscard]] std::string robot_uri(const CellRobot& robot) const;
  [[nodiscard]] int store_port() const { return ports; }
  [[nodiscard]] int camera_port() const { return ports + 1; }
  [[nodiscard]] int coordinator_port() const { return ports + 2; }
  /// Returns the port of a robot with a profile: ports + 3 for the first, and then in their order.
  [[nodiscard]] int robot_port(const CellRobot& robot) const;
  /// Returns the robot's name on this machine, unique among cells: CELL-ROBOT.
  [[nodiscard]] std::string robot_name(const CellRobot& robot) const { return name + "-" + robot.name; }
  /// Return the scene's Unix sockets: a servo controller's serial line, and the picture.
  [[nodiscard]] std::filesystem::path servo_socket(const CellRobot& robot) const;
  [[nodiscard]] std::filesystem::path picture_socket() const { return state_directory / "picture.sock"; }
  /// Returns the file in which the coordinator keeps Pause and Stop; empty without a directory.
  [[nodiscard]] std::filesystem::path hold_file() const {
    return state_directory.empty() ? state_directory : state_directory / "hold";
  }
  /// Returns the record of the robots' activities: see activity.h.
  [[nodiscard]] std::filesystem::path activity_file() const { return state_directory / "activity.jsonl"; }
};

/// Object keys of the cell's objects.
inline constexpr const char* kStoreKey = "Store";
inline constexpr const char* kCameraKey = "Camera";
inline constexpr const char* kCoordinatorKey = "Coordinator";

/// Command-line values that replace the file's values.
struct CellOverrides {
  std::optional<std::string> name;
  std::optional<int> ports;
  std::filesystem::path state_directory;  ///< empty: cells/NAME in corbot's own state directory
  std::optional<int> pieces;
  std::optional<std::uint64_t> seed;
};

/// Reads and checks a cell. Throws ConfigError with all faults: line, key, value and allowed values.
[[nodiscard]] CellConfig load_cell(const std::filesystem::path& file, const CellOverrides& overrides = {});

}  // namespace corbot::cell
