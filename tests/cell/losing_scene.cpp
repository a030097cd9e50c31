// SPDX-License-Identifier: Apache-2.0
// A scene that loses a piece. Tests show with it that the end of a cell's run names the loss. The variable
// CORBOT_LOSES_AT names a place. Once all pieces stand at the place, the scene removes the first one there.
// With "the way" instead of a place, the first held piece slips out of its hand on its way between places.
#include <algorithm>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "cell/scene/scene_program.h"

namespace corbot::cell {
namespace {

class Loss {
 public:
  explicit Loss(const Place& place) : place_(place) {}

  void operator()(sim::Pieces& pieces) {
    if (is_done_) return;
    std::vector<std::size_t> here;
    for (std::size_t i = 0; i < pieces.all().size(); ++i) {
      const sim::Piece& piece = pieces.all()[i];
      if (piece.state == sim::PieceState::kStanding && place_.covers(piece.foot_m)) here.push_back(i);
    }
    if (here.empty()) return;
    if (!first_) first_ = here.front();
    if (here.size() < pieces.all().size()) return;
    pieces.take_away(*first_);
    is_done_ = true;
  }

 private:
  const Place place_;
  std::optional<std::size_t> first_;  ///< this piece came to the place first
  bool is_done_{false};
};

/// Drops the first piece that is so high that the hand carries it over others, and over no place.
class Drop {
 public:
  explicit Drop(std::vector<Place> places) : places_(std::move(places)) {}

  void operator()(sim::Pieces& pieces) {
    for (std::size_t i = 0; i < pieces.all().size() && !is_done_; ++i) {
      const sim::Piece& piece = pieces.all()[i];
      const auto is_under = [&](const Place& place) { return place.covers(piece.foot_m, kOnPlace_m); };
      if (piece.state != sim::PieceState::kHeld || piece.foot_m.z() < kCarried_m) continue;
      if (std::any_of(places_.begin(), places_.end(), is_under)) continue;
      pieces.drop(i);
      is_done_ = true;
    }
  }

 private:
  static constexpr double kCarried_m = 0.05;
  const std::vector<Place> places_;
  bool is_done_{false};
};

Scene::AfterTick loss(const CellConfig& cell) {
  const char* const name = std::getenv("CORBOT_LOSES_AT");
  if (name != nullptr && std::string_view(name) == "the way") return Drop(cell.places);
  const Place* const place = name == nullptr ? nullptr : cell.place(name);
  if (place == nullptr) throw std::runtime_error("CORBOT_LOSES_AT names no place of the cell");
  return Loss(*place);
}

}  // namespace
}  // namespace corbot::cell

int main(int argc, char** argv) { return corbot::cell::scene_main(argc, argv, corbot::cell::loss); }
