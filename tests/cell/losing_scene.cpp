// SPDX-License-Identifier: Apache-2.0
// A scene that loses a piece. Tests show with it that the end of a cell's run names the loss. The variable
// CORBOT_LOSES_AT names a place. Once all pieces stand at the place, the scene removes the first one there.
#include <cstdlib>
#include <optional>
#include <stdexcept>
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

Scene::AfterTick loss(const CellConfig& cell) {
  const char* const name = std::getenv("CORBOT_LOSES_AT");
  const Place* const place = name == nullptr ? nullptr : cell.place(name);
  if (place == nullptr) throw std::runtime_error("CORBOT_LOSES_AT names no place of the cell");
  return Loss(*place);
}

}  // namespace
}  // namespace corbot::cell

int main(int argc, char** argv) { return corbot::cell::scene_main(argc, argv, corbot::cell::loss); }
