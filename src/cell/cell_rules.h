// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "cell/cell_config.h"

// Rules of a cell that join several values of its description.

namespace corbot::cell {

/// Whether an ORB can look it up: corbaloc, corbaname, or a reference as a text.
[[nodiscard]] bool is_reference(std::string_view text);
inline constexpr const char* kReferenceRule = "must begin with corbaloc:, corbaname: or IOR:";

/// Whether the scene's last line uses the word beside the places' names.
[[nodiscard]] bool is_word_of_scene(std::string_view name);

/// Whether the outlines of two places have a point in common, seen from above.
[[nodiscard]] bool overlap(const Place& a, const Place& b);
/// Whether one hue belongs to both kinds.
[[nodiscard]] bool share_hue(const Kind& a, const Kind& b);

/// A file name without a directory.
[[nodiscard]] bool is_plain_file_name(const std::filesystem::path& name);

/// Characters with a meaning in the files that name the state directory, and those that no terminal shows.
[[nodiscard]] bool has_special_character(std::string_view path);
/// The same text with ? in place of what no terminal shows.
[[nodiscard]] std::string shown_text(std::string text);

/// The longest path of the sockets in the state directory, those of `corbot cell run` included.
[[nodiscard]] std::filesystem::path longest_socket(const CellConfig& cell);

/// Whether a calibrated camera's picture shows a place whole, with the labels of pieces at its edge.
[[nodiscard]] bool shows(const CameraModel& camera, const Place& place, const Kind& kind);
/// Places that the cell's camera does not show whole, joined by commas.
[[nodiscard]] std::string unseen_places(const CellConfig& cell);

/// Where the simulation scatters pieces: the first area from which a robot takes.
struct PieceRoom {
  const Place* area{};
  Eigen::Vector2d inside_m{};  ///< in which the pieces' axes are
  double spacing_m{};          ///< between two axes
  [[nodiscard]] int most() const;
};
[[nodiscard]] std::optional<PieceRoom> piece_room(const CellConfig& cell);
/// Why so many pieces cannot be scattered; empty where they can.
[[nodiscard]] std::string fault_of_pieces(const CellConfig& cell, int count);

}  // namespace corbot::cell
