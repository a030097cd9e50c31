// SPDX-License-Identifier: Apache-2.0
#include "sim/scene/pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "corbot/units.h"

namespace corbot::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kOpen_m = 0.032;
constexpr double kGrasp_m = 0.030;

Piece piece_at(double x_m, double y_m) {
  Piece piece;
  piece.width_m = 0.020;
  piece.height_m = 0.045;
  piece.foot_m = {x_m, y_m, 0};
  return piece;
}

constexpr double kSide_m = 0.018;

Piece square_at(double x_m, double y_m, double yaw_deg) {
  Piece piece = piece_at(x_m, y_m);
  piece.is_square = true;
  piece.width_m = kSide_m;
  piece.yaw_rad = to_radians(yaw_deg);
  return piece;
}

/// A hand along x at the origin over pieces on a table.
class PiecesTest : public ::testing::Test {
 protected:
  PiecesTest() { hand_.tool_m = {0, 0, kGrasp_m}; }
  void put(std::vector<Piece> pieces) {
    pieces_ = Pieces(std::move(pieces), [](const Vector3d&) { return 0.0; });
    open_to(kOpen_m);
  }
  void step() { pieces_.step({&hand_, 1}); }
  /// Moves in steps of a servo frame, with a standstill between two steps.
  void open_to(double opening_m) {
    while (std::abs(opening_m - hand_.opening_m) > 1e-9) {
      hand_.opening_m += std::clamp(opening_m - hand_.opening_m, -0.0013, 0.0013);
      step();
      step();
    }
  }
  void move_to(const Vector3d& tool_m) {
    const Vector3d way_m = tool_m - hand_.tool_m;
    const Vector3d from_m = hand_.tool_m;
    const int steps = static_cast<int>(way_m.norm() / 0.001) + 1;
    for (int i = 1; i <= steps; ++i) {
      hand_.tool_m = from_m + i / double(steps) * way_m;
      step();
    }
  }
  void turn_hand(double yaw_rad) { hand_.across = {-std::sin(yaw_rad), std::cos(yaw_rad), 0}; }
  /// Angle from the hand to the nearest side of the first piece.
  double turn_deg() const {
    const double yaw_rad = std::atan2(hand_.across.y(), hand_.across.x());
    return to_degrees(std::remainder(piece().yaw_rad - yaw_rad, std::numbers::pi / 2));
  }
  const Piece& piece(std::size_t number = 0) const { return pieces_.all()[number]; }

  Hand hand_;
  Pieces pieces_{{}, {}};
};

TEST_F(PiecesTest, AreTakenWhereTheyAreBetweenTheFingers) {
  struct Case {
    const char* name;
    Vector3d tool_m;
    bool is_taken;
  };
  // The hand points along x, so `across` is y.
  for (const Case& test : {Case{"middle", {0, 0, kGrasp_m}, true},
                           {"across, just inside", {0, 0.0059, kGrasp_m}, true},
                           {"across, just outside", {0, 0.0061, kGrasp_m}, false},
                           {"other side, outside", {0, -0.0061, kGrasp_m}, false},
                           {"along, just inside", {0.0079, 0, kGrasp_m}, true},
                           {"along, just outside", {-0.0081, 0, kGrasp_m}, false},
                           {"low enough", {0, 0, 0.0399}, true},
                           {"too high", {0, 0, 0.0401}, false},
                           {"high enough", {0, 0, 0.0051}, true},
                           {"too low", {0, 0, 0.0049}, false}}) {
    hand_.tool_m = test.tool_m;
    put({piece_at(0, 0)});
    open_to(0);
    EXPECT_EQ(piece().state == PieceState::kHeld, test.is_taken) << test.name;
  }
}

TEST_F(PiecesTest, ClosingFingersPushThePieceToTheMiddle) {
  hand_.tool_m = {0, 0.005, kGrasp_m};
  put({piece_at(0, 0)});
  open_to(0.0202);
  EXPECT_NEAR(piece().foot_m.y(), 0.005, 0.0011);
  EXPECT_EQ(piece().state, PieceState::kHeld);
}

TEST_F(PiecesTest, AHandThatClosesBesideAPieceAndMovesOntoItTakesNothing) {
  put({piece_at(0.05, 0)});
  open_to(0.010);
  move_to({0.05, 0, kGrasp_m});
  open_to(0);
  EXPECT_EQ(piece().state, PieceState::kStanding);
  EXPECT_EQ(piece().foot_m, Vector3d(0.05, 0, 0));
}

TEST_F(PiecesTest, AHeldPieceFollowsAndTurnsWithTheHand) {
  put({piece_at(0.004, 0)});
  open_to(0);
  move_to({0.1, 0.2, 0.15});
  EXPECT_LT((piece().foot_m - Vector3d(0.104, 0.2, 0.15 - kGrasp_m)).norm(), 1e-9);
  hand_.across = -Vector3d::UnitX();  // turned by 90 degrees
  step();
  EXPECT_LT((piece().foot_m - Vector3d(0.1, 0.204, 0.15 - kGrasp_m)).norm(), 1e-9);
}

TEST_F(PiecesTest, AReleasedPieceStandsOrFalls) {
  struct Case {
    const char* name;
    Vector3d tool_m;
    PieceState state;
  };
  for (const Case& test : {Case{"on the table", {0.2, 0, kGrasp_m}, PieceState::kStanding},
                           {"just low enough", {0.2, 0, kGrasp_m + 0.0049}, PieceState::kStanding},
                           {"a little too high", {0.2, 0, kGrasp_m + 0.0051}, PieceState::kFallen},
                           {"pressed into the table", {0.2, 0, kGrasp_m - 0.0049}, PieceState::kStanding},
                           {"pressed through the table", {0.2, 0, kGrasp_m - 0.0051}, PieceState::kFallen},
                           {"onto another", {0.1, 0.019, kGrasp_m}, PieceState::kFallen},
                           {"next to another", {0.1, 0.021, kGrasp_m}, PieceState::kStanding}}) {
    hand_.tool_m = {0, 0, kGrasp_m};
    put({piece_at(0, 0), piece_at(0.1, 0)});
    open_to(0);
    move_to({0, 0, 0.15});
    move_to({test.tool_m.x(), test.tool_m.y(), 0.15});
    move_to(test.tool_m);
    open_to(0.0205);
    EXPECT_EQ(piece().state, PieceState::kHeld) << test.name << ": not open wide enough";
    open_to(kOpen_m);
    EXPECT_EQ(piece().state, test.state) << test.name;
    EXPECT_EQ(piece().foot_m.z(), 0) << test.name;
    move_to(hand_.tool_m + Vector3d(0, 0, 0.1));
    EXPECT_NEAR((piece().foot_m - test.tool_m).head<2>().norm(), 0, 1e-3) << test.name << ": it stays there";
    hand_.tool_m.z() = kGrasp_m;
    open_to(0);
    EXPECT_EQ(piece().state == PieceState::kHeld, test.state == PieceState::kStanding)
        << test.name << ": what has fallen cannot be taken";
  }
}

TEST_F(PiecesTest, AHeldPieceThatSlipsFallsAndStaysWhereItFell) {
  put({piece_at(0, 0)});
  open_to(0);
  move_to({0.1, 0.05, 0.09});
  pieces_.drop(0);
  move_to({0.2, 0.05, 0.09});
  EXPECT_EQ(piece().state, PieceState::kFallen);
  EXPECT_LT((piece().foot_m - Vector3d(0.1, 0.05, 0)).norm(), 0.002);
}

TEST_F(PiecesTest, AHeldPiecePushesAStandingPieceOutOfItsWay) {
  struct Case {
    const char* name;
    double foot_m;  // height of the held piece
    double offset_m;
    Vector2d end_m;
  };
  for (const Case& test : {Case{"in the middle", 0.010, 0, {0.150, 0}},
                           {"beside the middle", 0.010, 0.0201, {0.100, 0.0201}},
                           {"just below its top", 0.044, 0, {0.150, 0}},
                           {"just above its top", 0.046, 0, {0.100, 0}}}) {
    hand_.tool_m = {0, 0, kGrasp_m};
    put({piece_at(0, 0), piece_at(0.100, test.offset_m)});
    open_to(0);
    move_to({0, 0, kGrasp_m + test.foot_m});
    move_to({0.130, 0, kGrasp_m + test.foot_m});
    EXPECT_EQ(piece(1).state, PieceState::kStanding) << test.name;
    EXPECT_LT((piece(1).foot_m.head<2>() - test.end_m).norm(), 1e-9) << test.name;
    EXPECT_EQ(piece().state, PieceState::kHeld) << test.name;
    EXPECT_NEAR(piece().foot_m.x(), 0.130, 1e-9) << test.name;
  }
}

// Servos arrive one after the other, so the last steps of a descent may be sideways.
TEST_F(PiecesTest, APieceThatComesFromAbovePushesNothingAlsoIfItsLastStepIsSideways) {
  put({piece_at(0, 0), piece_at(0.1, 0)});
  open_to(0);
  move_to({0, 0, 0.15});
  move_to({0.1, 0.015, 0.15});
  move_to({0.1, 0.015, kGrasp_m});
  move_to({0.1, 0.016, kGrasp_m});
  EXPECT_EQ(piece(1).foot_m, Vector3d(0.1, 0, 0));
}

TEST_F(PiecesTest, APieceThatIsPushedBesideItsMiddleGivesWayToThatSide) {
  put({piece_at(0, 0), piece_at(0.100, 0.008)});
  open_to(0);
  move_to({0, 0, kGrasp_m + 0.010});
  move_to({0.200, 0, kGrasp_m + 0.010});
  EXPECT_GT(piece(1).foot_m.y(), 0.010);
  EXPECT_GE((piece(1).foot_m - piece().foot_m).head<2>().norm(), 0.020 - 1e-9);
}

TEST_F(PiecesTest, AnotherHandTakesNothingFromTheOneThatHoldsIt) {
  put({piece_at(0, 0)});
  open_to(0);
  Hand other = hand_;
  other.opening_m = kOpen_m;
  const std::array<Hand, 2> hands{hand_, other};
  pieces_.step(hands);
  EXPECT_EQ(piece().state, PieceState::kHeld);
  EXPECT_EQ(piece().hand, 0u);
}

// The corners that the fingers touch are on a line 45 degrees less the turn from the closing direction.
TEST_F(PiecesTest, ClosingFingersTurnASquareIntoLineOrHoldItByItsCorners) {
  std::mt19937_64 random(4);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution(a, b)(random); };
  for (int i = 0; i < 2000; ++i) {
    turn_hand(between(-4, 4));
    const double wanted_deg = between(-45, 45);
    if (std::abs(std::abs(wanted_deg) - 30) < 1e-6) continue;
    const double hand_deg = to_degrees(std::atan2(hand_.across.y(), hand_.across.x()));
    hand_.tool_m = hand_.across * between(-0.003, 0.003) + Vector3d(0, 0, kGrasp_m);
    put({square_at(0, 0, wanted_deg + hand_deg + 90 * (i % 5))});
    const bool turns = std::abs(wanted_deg) < 30;
    const double grip_m =
        turns ? kSide_m : std::numbers::sqrt2 * kSide_m * std::cos(to_radians(45 - std::abs(wanted_deg)));
    for (double opening_m = kOpen_m; opening_m > 0; opening_m -= 0.0005) {
      open_to(opening_m);
      const double across_m = std::numbers::sqrt2 * kSide_m * std::cos(to_radians(45 - std::abs(turn_deg())));
      ASSERT_LE(std::abs((piece().foot_m - hand_.tool_m).dot(hand_.across)) * 2,
                std::max(opening_m - across_m, Pieces::kPlay_m) + 1e-9)
          << "between the fingers";
      ASSERT_LE(across_m, std::max(opening_m, grip_m) + 1e-9);
      ASSERT_EQ(piece().state == PieceState::kHeld, opening_m < grip_m + Pieces::kPlay_m)
          << wanted_deg << " at " << opening_m;
    }
    ASSERT_NEAR(turn_deg(), turns ? 0 : wanted_deg, 1e-9);
  }
}

TEST_F(PiecesTest, ASquareIsTakenIfItFitsBetweenTheFingersAsItStands) {
  for (const double yaw_deg : {0.0, 10.0, 30.0, 45.0}) {
    Piece piece = square_at(0, 0, yaw_deg);
    piece.width_m = 0.024;  // its diagonal exceeds the opening
    hand_.tool_m = {0, 0, kGrasp_m};
    put({piece});
    open_to(0);
    EXPECT_EQ(this->piece().state == PieceState::kHeld, yaw_deg < 20) << yaw_deg;
    EXPECT_NEAR(std::abs(turn_deg()), yaw_deg < 20 ? 0 : yaw_deg, 1e-9) << yaw_deg;
  }
}

TEST_F(PiecesTest, ASquareTurnsWithTheHandAndKeepsThatYawWhereItIsPutDown) {
  for (const double yaw_deg : {20.0, -40.0}) {
    turn_hand(0);
    hand_.tool_m = {0, 0, kGrasp_m};
    put({square_at(0, 0, yaw_deg)});
    open_to(0);
    move_to({0, 0, 0.15});
    turn_hand(0.5);
    move_to({0.1, 0.1, 0.15});
    move_to({0.1, 0.1, kGrasp_m});
    const double grip_deg = yaw_deg > 0 ? 0 : yaw_deg;
    const double grip_m = std::numbers::sqrt2 * kSide_m * std::cos(to_radians(45 - std::abs(grip_deg)));
    open_to(grip_m + 0.0009);
    EXPECT_EQ(piece().state, PieceState::kHeld) << yaw_deg;
    open_to(kOpen_m);
    EXPECT_EQ(piece().state, PieceState::kStanding) << yaw_deg;
    turn_hand(0.8);
    step();
    const double error_rad =
        std::remainder(piece().yaw_rad - to_radians(grip_deg) - 0.5, std::numbers::pi / 2);
    EXPECT_NEAR(error_rad, 0, 1e-9) << yaw_deg;
  }
}

TEST_F(PiecesTest, ASquareNeedsTheRoomOfTheCircleAroundIt) {
  for (const double apart_m : {0.0253, 0.0257}) {
    hand_.tool_m = {0, 0, kGrasp_m};
    put({square_at(0, 0, 0), square_at(0.1, 0, 0)});
    open_to(0);
    move_to({0, 0, 0.15});
    move_to({0.1 - apart_m, 0, 0.15});
    move_to({0.1 - apart_m, 0, kGrasp_m});
    open_to(kOpen_m);
    EXPECT_EQ(piece().state == PieceState::kStanding, apart_m > std::numbers::sqrt2 * kSide_m);
  }
}

TEST(Scatter, TwelvePiecesFitApartOnThePalletForEverySeed) {
  const Vector2d size_m(0.165 - 0.024, 0.110 - 0.024);
  std::vector<Vector2d> before;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const auto points = scatter(size_m, 0.036, 12, seed);
    ASSERT_TRUE(points) << seed;
    ASSERT_EQ(points->size(), 12u);
    for (std::size_t i = 0; i < points->size(); ++i) {
      const Vector2d& point = (*points)[i];
      EXPECT_LE(std::abs(point.x()), size_m.x() / 2 + 1e-9) << seed;
      EXPECT_LE(std::abs(point.y()), size_m.y() / 2 + 1e-9) << seed;
      for (std::size_t k = 0; k < i; ++k) EXPECT_GE((point - (*points)[k]).norm(), 0.036 - 1e-9) << seed;
    }
    EXPECT_NE(*points, before) << seed;
    EXPECT_EQ(*points, *scatter(size_m, 0.036, 12, seed)) << seed;
    before = *points;
  }
}

TEST(Scatter, MoreThanFitAreRefused) {
  EXPECT_FALSE(scatter({0.141, 0.086}, 0.036, 13, 1));
  EXPECT_FALSE(scatter({-0.001, 0.086}, 0.036, 1, 1));
  EXPECT_EQ(scatter({0, 0}, 0.036, 1, 1)->size(), 1u);
  EXPECT_TRUE(scatter({0, 0}, 0.036, 0, 1)->empty());
}

}  // namespace
}  // namespace corbot::sim
