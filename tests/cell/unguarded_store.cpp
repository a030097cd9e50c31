// SPDX-License-Identifier: Apache-2.0
// A store that does not check zones and makes the robots meet. A test shows that the end of a run names the
// touch. The store admits robot2 when robot1 holds its second piece. It admits robot1 when robot2 is on its
// way above the first piece. Robot2 stays there until robot1 has placed the second piece, so the test does
// not depend on time.
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>

#include "cell/orb_server.h"
#include "cell/program.h"
#include "cell/store/store_servant.h"

namespace corbot::cell {
namespace {

class MeetingStore final : public StoreServant {
 public:
  using StoreServant::StoreServant;

  Corbot::ClaimToken Claim(const char* robot, const char* who, Corbot::ClaimToken replaces) override {
    const Corbot::ClaimToken token = StoreServant::Claim(robot, who, replaces);
    const std::lock_guard lock(mutex_);
    robots_[token] = robot;
    return token;
  }

  void Enter(Corbot::ClaimToken token, const char* place, CORBA::Double timeout) override {
    std::unique_lock lock(mutex_);
    const bool is_first = robots_[token] == "robot1";
    const bool may_enter = changed_.wait_for(lock, std::chrono::duration<double>(timeout), [&] {
      return is_first ? !is_second_held_ || is_robot2_above_ : is_second_held_;
    });
    lock.unlock();
    if (!may_enter) throw Corbot::Occupied(place, is_first ? "robot2" : "robot1", 0);
    StoreServant::Enter(token, place, timeout);
  }

  void Advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
               const char* note) override {
    StoreServant::Advance(token, piece, step, note);
    std::unique_lock lock(mutex_);
    const bool is_first = robots_[token] == "robot1";
    is_second_held_ |= is_first && piece == 2 && step == Corbot::StepHeld;
    is_second_placed_ |= is_first && piece == 2 && step == Corbot::StepPlaced;
    is_robot2_above_ |= !is_first && step == Corbot::StepPicking;
    changed_.notify_all();
    if (is_first || step != Corbot::StepPicking) return;
    if (!changed_.wait_for(lock, kHold, [&] { return is_second_placed_; }))
      throw Corbot::NotReady("robot1 has not placed its second piece");  // the worker repeats the call
  }

 private:
  static constexpr std::chrono::seconds kHold{1};

  std::mutex mutex_;  ///< guards the following members
  std::condition_variable changed_;
  std::map<Corbot::ClaimToken, std::string> robots_;
  bool is_second_held_{false};
  bool is_robot2_above_{false};
  bool is_second_placed_{false};
};

void run(const CellConfig& cell) {
  Ledger ledger(cell, ZoneCheck::kOff);
  MeetingStore servant(ledger);
  OrbServer server(cell.host, {cell.store_port()});
  server.activate(kStoreKey, &servant);
  server.serve(kStoreKey);
  ledger.end_waiting();
}

}  // namespace
}  // namespace corbot::cell

int main(int argc, char** argv) {
  return corbot::cell::run_program(argc, argv,
                                   {.name = "unguarded_store",
                                    .about = "A store without the check of zones, where robots meet",
                                    .run = corbot::cell::run});
}
