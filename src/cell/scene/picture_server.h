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

/// Serves the scene's pictures at a Unix socket, mode 0600, by the protocol of picture_wire.h. A client gets
/// a picture for each byte that it sends. The server serves one client at a time, and drops a client that
/// does not take its picture within 2 s. At the limit of clients, a new client replaces the one idle for
/// longest.
class PictureServer {
 public:
  /// Draws a view: rows of pixels, each blue, green, red. Runs in the thread of run().
  using Draw = std::function<const std::vector<std::uint8_t>&(const SceneView& view)>;
  /// Returns the scene at an instant after the call, or nothing if the scene does not respond.
  using Look = std::function<std::optional<SceneView>()>;

  /// Listens at the socket. `size_px` is columns and rows of a picture. Throws std::runtime_error.
  PictureServer(const std::filesystem::path& socket, std::array<int, 2> size_px, Look look, Draw draw);
  PictureServer(const PictureServer&) = delete;
  PictureServer& operator=(const PictureServer&) = delete;
  ~PictureServer();

  /// Serves clients until a stop is requested.
  void run(const std::stop_token& stop);

 private:
  void serve_all(const std::vector<pollfd>& ready, const std::stop_token& stop);
  /// Closes the client idle for longest. Returns false if all clients wait for a picture.
  [[nodiscard]] bool make_room();
  /// Serves one client. Returns false if the client must be dropped.
  [[nodiscard]] bool serve(int client, const std::stop_token& stop);
  [[nodiscard]] static bool send_all(int client, std::span<const std::uint8_t> bytes,
                                     std::int64_t deadline_ns, const std::stop_token& stop);

  sim::UnixListener listener_;
  std::array<int, 2> size_px_;
  Look look_;
  Draw draw_;
  std::vector<int> clients_;  ///< the client idle for longest is first
  std::uint64_t number_{0};
};

}  // namespace corbot::cell
