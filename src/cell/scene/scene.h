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
  std::int64_t time_ns{};  ///< of its tick
  std::vector<sim::DrawnPiece> pieces;
  std::vector<sim::Capsule> arms;
};

/// The simulated world of a cell: the arms of the robots that the cell starts, each with its controller's
/// socket, and the pieces. Times are of one clock that does not run backwards.
class Scene {
 public:
  /// The length of a simulated step.
  static constexpr std::int64_t kTick_ns = 5'000'000;
  /// A test changes the pieces by it at the end of each tick.
  using AfterTick = std::function<void(sim::Pieces& pieces)>;

  /// Robots take part whose profile has `port = "unix:SCENE/NAME.servos"`. Pieces are scattered in the first
  /// area from which a robot takes. Throws ConfigError for a profile, client::Failure where the pieces do not
  /// fit, std::runtime_error where a socket is in use.
  explicit Scene(const CellConfig& cell, AfterTick after_tick = {});

  /// Adds what must be polled. exchange() is due when one of them is readable, and at next_answer_ns().
  void add_to(std::vector<pollfd>& fds) const;
  [[nodiscard]] std::optional<std::int64_t> next_answer_ns() const;
  /// Receives and sends what is due on the controllers' sockets.
  void exchange(std::int64_t now_ns);
  /// The world `kTick_ns` later: arms, pieces, distances.
  void tick(std::int64_t now_ns);

  /// A person's hand between two ticks, by a line of words; docs/cell.md lists them. The reply begins with "ok" or "error".
  std::string command(std::string_view line);
  /// A command has put down or taken away pieces: the cast is another.
  [[nodiscard]] bool is_changed() const noexcept { return commands_ > 0; }

  [[nodiscard]] SceneView view() const;
  /// For the record of the run. No program that drives robots reads it.
  [[nodiscard]] SceneCast cast() const;
  [[nodiscard]] SceneSample sample() const;
  /// "pallet1=0 store1=4 elsewhere=0 held=1 fallen=0 touches=0 nearest_mm=55.2".
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
  /// As many as at the start, in the first area.
  [[nodiscard]] std::vector<sim::Piece> scattered(std::uint64_t seed) const;
  std::string refill();
  std::string empty(const Place& place);
  [[nodiscard]] double surface_m(const Eigen::Vector3d& point) const;
  /// Its name; "elsewhere" where there is none.
  [[nodiscard]] std::string place_of(const sim::Piece& piece) const;

  const CellConfig cell_;
  const AfterTick after_tick_;
  std::vector<Robot> robots_;
  std::unique_ptr<sim::Pieces> pieces_;
  std::vector<sim::ArmBody> arms_;
  sim::ArmClearance clearance_;
  std::optional<std::int64_t> first_ns_;  ///< of the first tick
  std::int64_t time_ns_{0};               ///< of the last tick
  std::uint64_t commands_{0};             ///< that have changed the pieces
};

/// The colour of a kind's label: the middle of its hues, blue, green, red.
[[nodiscard]] std::array<std::uint8_t, 3> label_bgr(const Kind& kind);

}  // namespace corbot::cell
