// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <map>
#include <string>

#include "cell/store/ledger.h"
#include "support/paths.h"

namespace corbot::cell {

using Step = Corbot::TransferStep;

/// The demo's places. robot1 and robot3 bring pieces from pallet1 to store1, robot2 from there to pallet2.
inline CellConfig demo_cell(const std::filesystem::path& directory) {
  CellConfig cell;
  cell.name = "demo";
  cell.ledger = directory / "ledger.db";
  cell.places = {{"pallet1", {{0.085, 0.239, 0}}, Eigen::Vector2d(0.165, 0.110), {}, false},
                 {"store1", {{0.24, 0, 0}}, {}, SlotGrid{1, 4, {0.05, 0.05}}, true},
                 {"pallet2", {{0.395, -0.239, 0}}, {}, SlotGrid{4, 3, {0.045, 0.042}}, false}};
  for (const char* name : {"robot1", "robot2", "robot3"}) {
    CellRobot robot;
    robot.name = name;
    robot.frame.position_m = {robot.name == "robot2" ? 0.48 : 0, 0, 0};
    cell.robots.push_back(robot);
  }
  Kind kind;
  kind.name = "red";
  kind.width_m = 0.02;
  cell.kinds = {kind};
  return cell;
}

inline Corbot::Sightings sightings(std::initializer_list<Corbot::Point> points, const char* kind = "red") {
  Corbot::Sightings seen;
  seen.length(static_cast<CORBA::ULong>(points.size()));
  CORBA::ULong i = 0;
  for (const Corbot::Point& point : points) {
    seen[i].kind = kind;
    seen[i].position = point;
    seen[i].yaw = 0;
    seen[i++].confidence = 1;
  }
  return seen;
}

/// A ledger in a directory of its own, and its robots' claims.
class LedgerFixture : public ::testing::Test {
 protected:
  LedgerFixture() {
    for (const CellRobot& robot : cell_.robots) tokens_[robot.name] = ledger_.claim(robot.name, "test", 0);
  }
  ~LedgerFixture() override { std::filesystem::remove_all(directory_); }

  static std::filesystem::path make_directory() {
    std::string path = CORBOT_SCRATCH_DIR "/ledger-XXXXXX";
    return ::mkdtemp(path.data());
  }
  /// Reserves and carries a piece to the step that is the last of `steps`, in the zones that are needed.
  Corbot::PieceNumber carry(const std::string& robot, const std::string& from, const std::string& to,
                            std::initializer_list<Step> steps) {
    const auto piece = ledger_.reserve(tokens_[robot], from, to, seen_, 0).piece;
    ledger_.enter(tokens_[robot], "store1", 0);
    for (const Step step : steps) ledger_.advance(tokens_[robot], piece, step, "");
    ledger_.leave(tokens_[robot], "store1");
    return piece;
  }
  [[nodiscard]] Corbot::PlaceInfo place(CORBA::ULong index) { return ledger_.places()[index]; }

  const std::filesystem::path directory_{make_directory()};
  const CellConfig cell_{demo_cell(directory_)};
  Ledger ledger_{cell_};
  std::map<std::string, Corbot::ClaimToken> tokens_;
  const Corbot::Sightings seen_{sightings({{0.05, 0.22, 0}, {0.10, 0.22, 0}, {0.05, 0.26, 0}})};
};

inline constexpr std::initializer_list<Step> kToPlaced{Corbot::StepPicking, Corbot::StepHeld,
                                                       Corbot::StepPlacing, Corbot::StepPlaced};

}  // namespace corbot::cell
