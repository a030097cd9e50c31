// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "cell.hh"
#include "cell/cell_config.h"
#include "cli/cell/verdict.h"

namespace corbot::cli {

/// Describes why `what`, a program of a cell that another command started in `directory`, may not reply, and
/// what to do.
[[nodiscard]] std::string silence_text(const std::string& what, const std::string& uri,
                                       const std::string& error, const std::filesystem::path& directory);

/// A client of a cell's coordinator, store and camera. Throws every failure as client::Failure.
class CellClient {
 public:
  explicit CellClient(const cell::CellConfig& cell);
  CellClient(const CellClient&) = delete;
  CellClient& operator=(const CellClient&) = delete;
  ~CellClient();

  /// Ends the repetition of calls without a reply. Any thread may call it.
  void give_up() { gave_up_ = true; }
  /// Throws with kUnreachable if a robot or camera that runs elsewhere does not reply.
  void check_foreign();
  /// Expects a cell that another command started. From now on a missing reply is kUnreachable, and no call
  /// but that of stop() is repeated. Throws with kUnreachable if another cell has these ports.
  void expect_running();
  void start_work();
  [[nodiscard]] Corbot::CoordinatorState_var state();
  [[nodiscard]] bool is_paused();
  [[nodiscard]] Corbot::PlaceInfos_var places();
  [[nodiscard]] Corbot::PieceEvents_var unclear();
  void start();  ///< also ends a Pause
  void pause();
  /// Repeats the Stop for 20 s if its coordinator may come back, which would move the robots again. Says so.
  void stop();
  /// Records that the place is empty and the piece was removed.
  void resolve(Corbot::PieceNumber piece, const std::string& place, int slot, const std::string& who);
  void exchange(const std::string& place, const std::string& who);
  /// Ends the claim of a robot. Returns its owner, or "" if there was none.
  [[nodiscard]] std::string release(const std::string& robot, const std::string& who);
  /// Returns true if no robot is handling a piece.
  [[nodiscard]] bool has_no_transfer();
  /// Returns the number of pieces at places from which no robot takes, by the ledger.
  [[nodiscard]] int placed();
  /// Returns the last picture that the camera examined, as a JPEG file; `marked`: with the findings. One
  /// attempt.
  [[nodiscard]] std::vector<std::uint8_t> picture(bool marked);
  /// Reads the ledger, and counts the pieces in a picture taken now. Robots must be out of the picture.
  [[nodiscard]] CellEnd read_end();
  /// Reads the result of work that ended early: the ledger's events and the camera's last picture, as far as
  /// the programs reply.
  [[nodiscard]] CellEnd read_early_end();

 private:
  /// One of the three programs, for messages.
  struct Peer {
    const char* name;
    std::string uri;
    bool is_elsewhere;  ///< another command started it
  };
  [[nodiscard]] Peer store_peer() const {
    return {"the store", cell_.store_uri(), !cell_.store_reference.empty()};
  }
  [[nodiscard]] Peer camera_peer() const {
    return {"the camera", cell_.camera_uri(), !cell_.camera_reference.empty()};
  }
  [[nodiscard]] Peer coordinator_peer() const {
    return {"the coordinator", cell_.coordinator_uri(), !cell_.coordinator_reference.empty()};
  }
  template <class F>
  auto call(const Peer& peer, F&& f) -> decltype(f());
  template <class F>
  auto call(const Peer& peer, F&& f, std::chrono::seconds retry_for) -> decltype(f());
  /// Calls `f` with each event of the ledger after that number.
  template <class F>
  void for_each_event(CORBA::ULongLong after, F&& f);
  void read_events(CellEnd& end);
  void read_overruns(CellEnd& end);

  const cell::CellConfig& cell_;
  std::atomic<bool> gave_up_{false};
  bool is_ours_{true};
  std::atomic<CORBA::ULongLong> last_before_{0};  ///< number of the last event when the work began
  CORBA::ORB_var orb_;
  Corbot::Store_var store_;
  Corbot::Camera_var camera_;
  Corbot::Coordinator_var coordinator_;
};

}  // namespace corbot::cli
