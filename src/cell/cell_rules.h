// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cell/cell_config.h"

// Rules that concern several values of a cell's description.

namespace corbot::cell {

/// Tells if an ORB can resolve the text: corbaloc, corbaname, or a stringified IOR.
[[nodiscard]] bool is_reference(std::string_view text);
inline constexpr const char* kReferenceRule = "must begin with corbaloc:, corbaname: or IOR:";

/// Tells if the scene's last line of output uses the word beside the places' names.
[[nodiscard]] bool is_word_of_scene(std::string_view name);

/// Tells if the outlines of two places, seen from above, have a common point.
[[nodiscard]] bool overlap(const Place& a, const Place& b);
/// Tells if a hue belongs to both kinds.
[[nodiscard]] bool share_hue(const Kind& a, const Kind& b);

/// Returns a place from which robots take, but none of them brings pieces of the kind to a row for it. Empty:
/// there is no such place.
[[nodiscard]] std::string place_that_keeps(const CellConfig& cell, const Kind& kind);

/// Tells if the path is a file name without a directory.
[[nodiscard]] bool is_plain_file_name(const std::filesystem::path& name);

/// Tells if a path has an unprintable character, or a special one of the files that name the state directory.
[[nodiscard]] bool has_special_character(std::string_view path);
/// Returns the text with ? for each unprintable character.
[[nodiscard]] std::string shown_text(std::string text);

/// Returns the longest socket path in the state directory, including the sockets of `corbot cell run`.
[[nodiscard]] std::filesystem::path longest_socket(const CellConfig& cell);

/// Tells if a calibrated camera's picture shows a whole place and the labels of pieces at its edge.
[[nodiscard]] bool shows(const CameraModel& camera, const Place& place, const Kind& kind);
/// Returns the names of the places that the camera does not show whole, joined by commas.
[[nodiscard]] std::string unseen_places(const CellConfig& cell);

/// The least distance between the rims of two pieces, for an open finger and its clearance.
inline constexpr double kRimSpacing_m = 0.016;
/// Returns the diameter of the circle around the widest piece; 0 without a kind.
[[nodiscard]] double widest_m(const std::vector<Kind>& kinds);

/// The region in which the simulation scatters pieces: the first area from which a robot takes.
struct PieceRoom {
  const Place* area{};
  Eigen::Vector2d inside_m{};  ///< region of the pieces' axes
  double spacing_m{};          ///< least distance between two axes
  [[nodiscard]] int most() const;
};
[[nodiscard]] std::optional<PieceRoom> piece_room(const CellConfig& cell);
/// Returns why the simulation cannot scatter `count` pieces; empty if it can.
[[nodiscard]] std::string fault_of_pieces(const CellConfig& cell, int count);

}  // namespace corbot::cell
