// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "cell/cell_config.h"
#include "cell/scene_record.h"
#include "sim/scene/arm_body.h"
#include "sim/scene/picture.h"
#include "sim/scene/pieces.h"
#include "sim/scene/servo_socket.h"

namespace corbot::cell {

/// The contents of one picture.
struct SceneView {
  std::int64_t time_ns{};  ///< time of the tick
  std::vector<sim::DrawnPiece> pieces;
  std::vector<sim::Capsule> arms;
};

/// The simulated world of a cell: arms, sockets of the servo controllers, and pieces. All times are of one
/// monotonic clock.
class Scene {
 public:
  /// The length of a simulation step.
  static constexpr std::int64_t kTick_ns = 5'000'000;
  /// A test's function that changes the pieces at the end of each tick.
  using AfterTick = std::function<void(sim::Pieces& pieces)>;

  /// Simulates the robots whose profile has `port = "unix:SCENE/NAME.servos"`. Scatters pieces in the first
  /// area from which a robot takes. Throws ConfigError for a faulty profile, client::Failure if the pieces do
  /// not fit, and std::runtime_error if a socket is in use.
  explicit Scene(const CellConfig& cell, AfterTick after_tick = {});

  /// Adds the descriptors to poll. Call exchange() when one is readable, and at next_answer_ns().
  void add_to(std::vector<pollfd>& fds) const;
  [[nodiscard]] std::optional<std::int64_t> next_answer_ns() const;
  /// Receives requests and sends due replies on the controllers' sockets.
  void exchange(std::int64_t now_ns);
  /// Simulates one step of `kTick_ns`: arms, pieces, distances.
  void tick(std::int64_t now_ns);

  /// Carries out a command line of docs/cell.md, which stands for a person's hand. Call it between two ticks.
  /// The reply begins with "ok" or "error".
  std::string command(std::string_view line);
  /// Tells if a command has added or removed pieces, so that cast() differs from the begin.
  [[nodiscard]] bool is_changed() const noexcept { return commands_ > 0; }

  [[nodiscard]] SceneView view() const;
  /// Returns the cast for the record of the run. Programs that drive robots do not use it.
  [[nodiscard]] SceneCast cast() const;
  [[nodiscard]] SceneSample sample() const;
  /// Returns "pallet1=0 store1=4 elsewhere=0 held=1 fallen=0 touches=0 nearest_mm=55.2".
  [[nodiscard]] std::string summary() const;

 private:
  struct Robot {
    std::string name;
    ArmModel model;
    sim::ArmBase base;
    double opening_m;
    std::unique_ptr<sim::ServoSocket> servos;
  };
  void add_robot(const CellRobot& robot);
  /// Returns as many pieces as at the start, scattered in the first area.
  [[nodiscard]] std::vector<sim::Piece> scattered(std::uint64_t seed) const;
  std::string refill();
  std::string empty(const Place& place);
  [[nodiscard]] double surface_m(const Eigen::Vector3d& point) const;
  /// Returns the name of the piece's place; "elsewhere" if it is on no place.
  [[nodiscard]] std::string place_of(const sim::Piece& piece) const;

  const CellConfig cell_;
  const AfterTick after_tick_;
  std::vector<Robot> robots_;
  std::unique_ptr<sim::Pieces> pieces_;
  std::vector<sim::ArmBody> arms_;
  sim::ArmClearance clearance_;
  std::optional<std::int64_t> first_ns_;  ///< time of the first tick
  std::int64_t time_ns_{0};               ///< time of the last tick
  std::uint64_t commands_{0};             ///< count of commands that changed the pieces
};

/// Returns the colour of a kind's label, the middle of its hues, as blue, green, red.
[[nodiscard]] std::array<std::uint8_t, 3> label_bgr(const Kind& kind);

}  // namespace corbot::cell
