// SPDX-License-Identifier: Apache-2.0
// Carries two pieces from the near row of a tray to the far one. It works with any arm: the tray hangs below
// the position of the tool when the arm is ready. A PUMA, a SCARA and a gantry therefore carry it out alike.
// Usage: tray [REFERENCE]
#include <cmath>
#include <cstdio>

#include "arm.hh"

namespace {

constexpr double kPitch_m = 0.04;  // from place to place, towards -x and -y
constexpr double kBelow_m = 0.06;  // distance of the tray below the ready arm's tool
constexpr double kAbove_m = 0.04;  // height at which a straight approach begins
constexpr double kWithin_m = 1e-4;

class Hand {
 public:
  explicit Hand(Corbot::Arm_ptr arm) : arm_(Corbot::Arm::_duplicate(arm)) {}

  /// Returns the position of the tool, base frame.
  Corbot::Point place() {
    const Corbot::CartesianCoord at = arm_->CartCoord();
    return {at.x, at.y, at.z};
  }
  /// Moves freely over the place, then down and up in straight lines; the tool keeps its orientation.
  void visit(const Corbot::Point& p, bool take) {
    arm_->Move(p.x, p.y, p.z, kAbove_m, 0);
    check(p, kAbove_m);
    arm_->MoveS(p.x, p.y, p.z, 0, 0);
    check(p, 0);
    take ? arm_->Close() : arm_->Open();
    arm_->MoveS(p.x, p.y, p.z, kAbove_m, 0);
    std::printf("%s (%.4f, %.4f, %.4f) m\n", take ? "taken from" : "put down at", p.x, p.y, p.z);
  }
  /// Moves in an arc that rises by half the distance of two places.
  void over_to(const Corbot::Point& end) {
    const Corbot::Point from = place();
    const Corbot::Point middle{(from.x + end.x) / 2, (from.y + end.y) / 2, end.z + kPitch_m / 2};
    arm_->MoveC(from, middle, end);
    check(end, 0);
  }

 private:
  void check(const Corbot::Point& p, double above_m) {
    const Corbot::Point at = place();
    if (std::hypot(at.x - p.x, at.y - p.y, at.z - p.z - above_m) > kWithin_m) {
      throw Corbot::NotReady("the tool is not where it was sent");
    }
  }
  Corbot::Arm_var arm_;
};

}  // namespace

int main(int argc, char** argv) {
  try {
    CORBA::ORB_var orb = CORBA::ORB_init(argc, argv);
    CORBA::Object_var object =
        orb->string_to_object(argc > 1 ? argv[1] : "corbaloc::127.0.0.1:12810/puma560");
    Corbot::Arm_var arm = Corbot::Arm::_narrow(object);
    std::printf("an arm of %d joints\n", static_cast<int>(arm->DoF()));
    Hand hand(arm);
    arm->Ready();
    arm->Open();
    const Corbot::Point ready = hand.place();
    for (int column = 0; column < 2; ++column) {
      const double y = ready.y - column * kPitch_m;
      hand.visit({ready.x - kPitch_m, y, ready.z - kBelow_m}, true);
      hand.visit({ready.x - 2 * kPitch_m, y, ready.z - kBelow_m}, false);
    }
    hand.over_to({ready.x - kPitch_m, ready.y, ready.z - kBelow_m + kAbove_m});
    arm->Ready();
    std::printf("done\n");
  } catch (const Corbot::Unreachable& refusal) {
    std::fprintf(stderr, "nothing moved: %s\n", refusal.reason.in());
    return 1;
  } catch (const Corbot::LimitExceeded& refusal) {  // degrees; metres for a sliding joint
    std::fprintf(stderr, "nothing moved: %s of joint %d: %g is not within %g to %g\n", refusal.quantity.in(),
                 static_cast<int>(refusal.articulation), refusal.value, refusal.lower, refusal.upper);
    return 1;
  } catch (const Corbot::NotReady& error) {
    std::fprintf(stderr, "%s\n", error.reason.in());
    return 1;
  } catch (const CORBA::Exception& error) {
    const bool nobody = CORBA::TRANSIENT::_downcast(&error) != nullptr;
    std::fprintf(stderr, "%s%s\n", error._name(), nobody ? ": is the robot up?" : "");
    return 1;
  }
}
