// SPDX-License-Identifier: Apache-2.0
import Corbot.LimitExceeded;
import Corbot.Unreachable;

/** Joints over time: a path, and a law along it whose speed and acceleration begin and end at zero. */
final class Motion {
  /** The joints at `s`, 0 to 1, of the way. */
  interface Way {
    double[] at(double s) throws Unreachable, LimitExceeded;
  }

  private static final int SAMPLES = 200;
  private static final double JUMP = 1; // degrees, at the begin of a way
  // Of the law s(t) = t^3 (10 - 15 t + 6 t^2), 0 <= t <= 1.
  private static final double MOST_SPEED = 1.875;
  private static final double MOST_ACCELERATION = 5.7736;

  final double seconds;
  private final double[][] joints = new double[SAMPLES + 1][];

  /** `length` in metres, with its speed, of a line or arc; 0 of a free motion. `t`: no sooner than that. */
  Motion(Way way, double length, double lineSpeed, double[] jointSpeeds, double t)
      throws Unreachable, LimitExceeded {
    for (int i = 0; i <= SAMPLES; i++) {
      joints[i] = way.at((double) i / SAMPLES);
    }
    double least = Math.max(t, leastSeconds(length, lineSpeed, 0, Arm.LINE_ACCELERATION));
    for (int joint = 0; joint < Arm.DOF; joint++) {
      for (int i = 1; i < SAMPLES; i++) {
        double before = joints[i - 1][joint];
        double after = joints[i + 1][joint];
        double slope = Math.abs(after - before) * SAMPLES / 2;
        double bend = Math.abs(after - 2 * joints[i][joint] + before) * SAMPLES * SAMPLES;
        least = Math.max(least, leastSeconds(slope, jointSpeeds[joint], bend, Arm.JOINTS[joint].acceleration()));
      }
    }
    seconds = least;
  }

  /** The same way, refused where it does not begin at the joints `from`: the arm is folded back there. */
  static Way beginningAt(double[] from, Way way) throws Unreachable, LimitExceeded {
    double[] first = way.at(0);
    for (int joint = 0; joint < Arm.DOF; joint++) {
      if (Math.abs(first[joint] - from[joint]) > JUMP) {
        throw new Unreachable(Arm.tool(from).point(), "no line begins here: the arm is folded back, Move it first");
      }
    }
    return way;
  }

  double[] at(double time) {
    double t = seconds > 0 ? Math.min(time / seconds, 1) : 1;
    double sample = t * t * t * (10 + t * (6 * t - 15)) * SAMPLES;
    int i = Math.min((int) sample, SAMPLES - 1);
    double[] q = new double[Arm.DOF];
    for (int joint = 0; joint < Arm.DOF; joint++) {
      q[joint] = joints[i][joint] + (sample - i) * (joints[i + 1][joint] - joints[i][joint]);
    }
    return q;
  }

  private static double leastSeconds(double slope, double speed, double bend, double acceleration) {
    double bySpeed = MOST_SPEED * slope / speed;
    double byAcceleration = (MOST_ACCELERATION * slope + MOST_SPEED * MOST_SPEED * bend) / acceleration;
    return Math.max(bySpeed, Math.sqrt(byAcceleration));
  }
}
