// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "cell.hh"
#include "cell/cell_config.h"
#include "cli/cell/verdict.h"

namespace corbot::cli {

/// A store's refusal, for a person.
[[nodiscard]] std::string refusal_text(const Corbot::BadParameter& error);
/// Why `what`, a program of a cell that another command started in `directory`, may be silent, and what to do.
[[nodiscard]] std::string silence_text(const std::string& what, const std::string& uri,
                                       const std::string& error, const std::filesystem::path& directory);

/// A client of a cell's coordinator, store and camera. Every failure leaves as a client::Failure.
class CellClient {
 public:
  explicit CellClient(const cell::CellConfig& cell);
  CellClient(const CellClient&) = delete;
  CellClient& operator=(const CellClient&) = delete;
  ~CellClient();

  /// From now on a call that gets no reply is not repeated. From any thread.
  void give_up() { gave_up_ = true; }
  /// Throws with kUnreachable where a robot or camera that runs elsewhere does not reply.
  void check_foreign();
  /// The cell was started by another command: from now on no reply is kUnreachable, and no call is repeated. Throws with
  /// kUnreachable where another cell has these ports.
  void expect_running();
  void start_work();
  [[nodiscard]] Corbot::CoordinatorState_var state();
  [[nodiscard]] bool is_paused();
  [[nodiscard]] Corbot::PlaceInfos_var places();
  [[nodiscard]] Corbot::PieceEvents_var unclear();
  void start();  ///< and ends a Pause
  void pause();
  void stop();
  /// An empty place: the piece was taken away.
  void resolve(Corbot::PieceNumber piece, const std::string& place, int slot, const std::string& who);
  void exchange(const std::string& place, const std::string& who);
  /// Ends the claim of a robot, and returns whose it was; empty: there was none.
  [[nodiscard]] std::string release(const std::string& robot, const std::string& who);
  /// Whether no robot has a piece in work.
  [[nodiscard]] bool has_no_transfer();
  /// Pieces at places from which no robot takes, by the ledger.
  [[nodiscard]] int placed();
  /// The last picture that the camera examined, a JPEG file; marked: with what was found. One attempt.
  [[nodiscard]] std::vector<std::uint8_t> picture(bool marked);
  /// Reads the ledger, and counts the pieces in a picture taken now. Robots must be out of the picture.
  [[nodiscard]] CellEnd read_end();
  /// Of work that ended early: the ledger's events and the camera's last picture, as far as they reply.
  [[nodiscard]] CellEnd read_early_end();

 private:
  /// One of the three, for messages.
  struct Peer {
    const char* name;
    std::string uri;
    bool is_elsewhere;  ///< this command did not start it
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
