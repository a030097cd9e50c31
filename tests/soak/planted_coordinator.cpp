// SPDX-License-Identifier: Apache-2.0
// This coordinator has a fault in it, which the soak of the cell must find. The variable CORBOT_PLANTED names
// the fault.
#include <cstdlib>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "cell/coordinator/coordinator_program.h"

namespace corbot::cell {
namespace {

/// One robot's ports. Each call passes to the ports of the plain coordinator, except where a fault overrides
/// it.
class Ports : public RobotPort, public CameraPort, public StorePort {
 public:
  Ports(const CellRobot& robot, WorkerPorts to) : robot_(robot), to_(to) {}

  bool acquire() override { return to_.robot.acquire(); }
  void release() override { to_.robot.release(); }
  void speed(double percent) override { to_.robot.speed(percent); }
  void move(const Eigen::Vector3d& point, double above_m) override { to_.robot.move(point, above_m); }
  void move_s(const Eigen::Vector3d& point, double above_m, double duration_s) override {
    to_.robot.move_s(point, above_m, duration_s);
  }
  void move_c(const Eigen::Vector3d& begin, const Eigen::Vector3d& middle,
              const Eigen::Vector3d& end) override {
    to_.robot.move_c(begin, middle, end);
  }
  void delay(double duration_s) override { to_.robot.delay(duration_s); }
  void open() override { to_.robot.open(); }
  void close() override { to_.robot.close(); }
  Eigen::Vector3d rest_position() override { return to_.robot.rest_position(); }
  Grip grip() override { return to_.robot.grip(); }
  bool is_able() override { return to_.robot.is_able(); }
  bool is_halted() override { return to_.robot.is_halted(); }
  void stop() override { to_.robot.stop(); }

  Corbot::Frame look(double timeout_s) override { return to_.camera.look(timeout_s); }

  Corbot::ClaimToken claim(const std::string& robot, const std::string& who,
                           Corbot::ClaimToken replaces) override {
    return to_.store.claim(robot, who, replaces);
  }
  void release(Corbot::ClaimToken token) override { to_.store.release(token); }
  Corbot::TransferInfo reserve(Corbot::ClaimToken token, const std::string& from, const std::string& to,
                               const Corbot::Sightings& seen, double timeout_s) override {
    return to_.store.reserve(token, from, to, seen, timeout_s);
  }
  void advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
               const std::string& note) override {
    to_.store.advance(token, piece, step, note);
  }
  void enter(Corbot::ClaimToken token, const std::string& place, double timeout_s) override {
    to_.store.enter(token, place, timeout_s);
  }
  void leave(Corbot::ClaimToken token, const std::string& place) override { to_.store.leave(token, place); }
  Corbot::PlaceInfos places() override { return to_.store.places(); }
  Corbot::TransferInfos transfers() override { return to_.store.transfers(); }
  Corbot::PieceEvents unclear() override { return to_.store.unclear(); }

 protected:
  const CellRobot& robot_;
  const WorkerPorts to_;
};

/// The intent reaches the ledger after the motions, with the next step.
class LateIntent : public Ports {
 public:
  using Ports::Ports;
  void advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
               const std::string& note) override {
    const std::lock_guard lock(mutex_);
    if (step == Corbot::StepPicking || step == Corbot::StepPlacing) {
      intent_ = step;
      return;
    }
    if (intent_) Ports::advance(token, piece, *intent_, "");
    intent_.reset();
    Ports::advance(token, piece, step, note);
  }
  /// The worker asks for them where a fault has interrupted its work.
  Corbot::TransferInfos transfers() override {
    const std::lock_guard lock(mutex_);
    intent_.reset();
    return Ports::transfers();
  }

 private:
  std::mutex mutex_;  ///< the worker sends intents from another thread
  std::optional<Corbot::TransferStep> intent_;
};

/// After a fault, a piece that the robot was picking counts as held, wherever it is.
class HeldUnseen : public Ports {
 public:
  using Ports::Ports;
  Corbot::TransferInfos transfers() override {
    Corbot::TransferInfos all = Ports::transfers();
    is_blind_ = false;
    grips_ = 0;
    for (CORBA::ULong i = 0; i < all.length(); ++i)
      is_blind_ |= all[i].robot.in() == robot_.name && all[i].step == Corbot::StepPicking;
    return all;
  }
  /// The first reply of a resolution decides what the gripper does, the next one what the piece does.
  Grip grip() override { return is_blind_ && ++grips_ > 1 ? Grip::kClosed : Ports::grip(); }
  Corbot::Frame look(double timeout_s) override {
    Corbot::Frame frame = Ports::look(timeout_s);
    if (is_blind_) frame.pieces.length(0);
    return frame;
  }
  void advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
               const std::string& note) override {
    Ports::advance(token, piece, step, note);
    is_blind_ = false;
  }

 private:
  bool is_blind_{false};
  int grips_{0};
};

/// The robot gives back its zone as it begins to rise from the place.
class EarlyLeave : public Ports {
 public:
  using Ports::Ports;
  void enter(Corbot::ClaimToken token, const std::string& place, double timeout_s) override {
    Ports::enter(token, place, timeout_s);
    token_ = token;
    zone_ = place;
  }
  void move_s(const Eigen::Vector3d& point, double above_m, double duration_s) override {
    const bool is_over_zone = !zone_.empty() && above_m > 0;
    if (is_over_zone) Ports::leave(token_, std::exchange(zone_, ""));
    Ports::move_s(point, above_m, duration_s);
  }
  void leave(Corbot::ClaimToken token, const std::string& place) override {
    if (zone_ == place) zone_.clear();
    Ports::leave(token, place);
  }

 private:
  Corbot::ClaimToken token_{0};
  std::string zone_;
};

template <class Fault>
std::unique_ptr<Ports> make(const CellRobot& robot, WorkerPorts to) {
  return std::make_unique<Fault>(robot, to);
}

std::function<std::unique_ptr<Ports>(const CellRobot&, WorkerPorts)> planted() {
  const char* const name = std::getenv("CORBOT_PLANTED");
  const std::string fault = name == nullptr ? "" : name;
  if (fault == "late-intent") return make<LateIntent>;
  if (fault == "held-unseen") return make<HeldUnseen>;
  if (fault == "early-leave") return make<EarlyLeave>;
  throw std::runtime_error("CORBOT_PLANTED names no fault: '" + fault + "'");
}

}  // namespace
}  // namespace corbot::cell

int main(int argc, char** argv) {
  std::vector<std::unique_ptr<corbot::cell::Ports>> all;  // they outlive the workers
  return corbot::cell::coordinator_main(
      argc, argv, [&all](const corbot::cell::CellRobot& robot, corbot::cell::WorkerPorts to) {
        corbot::cell::Ports& ports = *all.emplace_back(corbot::cell::planted()(robot, to));
        return corbot::cell::WorkerPorts{ports, ports, ports};
      });
}
