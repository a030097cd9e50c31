// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "cell/scene/scene.h"
#include "sim/devices/unix_listener.h"

namespace corbot::cell {

/// The scene's pictures at a Unix socket, mode 0600, as picture_wire.h has it. A client gets a picture for
/// each byte that it sends, one client after the other; one that does not take its picture within 2 s is
/// dropped. Where all places are taken, the client that was idle for longest is closed for the next.
class PictureServer {
 public:
  /// Draws a view: rows of pixels, blue, green, red. Called in the thread of run().
  using Draw = std::function<const std::vector<std::uint8_t>&(const SceneView& view)>;
  /// The scene at an instant after the call; nothing where it does not respond.
  using Look = std::function<std::optional<SceneView>()>;

  /// Listens. `size_px`: columns and rows of what is drawn. Throws std::runtime_error.
  PictureServer(const std::filesystem::path& socket, std::array<int, 2> size_px, Look look, Draw draw);
  PictureServer(const PictureServer&) = delete;
  PictureServer& operator=(const PictureServer&) = delete;
  ~PictureServer();

  /// Serves clients until a stop is requested.
  void run(const std::stop_token& stop);

 private:
  void serve_all(const std::vector<pollfd>& ready, const std::stop_token& stop);
  /// Closes the client that was idle for longest. False where all have asked for a picture.
  [[nodiscard]] bool make_room();
  /// False where the client is to be dropped.
  [[nodiscard]] bool serve(int client, const std::stop_token& stop);
  [[nodiscard]] static bool send_all(int client, std::span<const std::uint8_t> bytes,
                                     std::int64_t deadline_ns, const std::stop_token& stop);

  sim::UnixListener listener_;
  std::array<int, 2> size_px_;
  Look look_;
  Draw draw_;
  std::vector<int> clients_;  ///< the one that was idle for longest first
  std::uint64_t number_{0};
};

}  // namespace corbot::cell
