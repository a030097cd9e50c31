// SPDX-License-Identifier: Apache-2.0
import Corbot.LimitExceeded;
import Corbot.Point;
import Corbot.Unreachable;
import java.util.Arrays;

/** Joints over time: a path, and a law along it whose speed and acceleration begin and end at zero. */
final class Motion {
  /** Limits set by Speed and ArtSpeed: a share of the maximum, and of each joint's. */
  record Limits(double share, double[] joints) {
    double joint(int joint) {
      return joints[joint] * Arm.JOINTS[joint].speed();
    }
  }

  /** Returns the joints at `s`, 0 to 1, of the path. */
  private interface Way {
    double[] at(double s) throws Unreachable, LimitExceeded;
  }

  private static final int SAMPLES = 200;
  private static final double JUMP = 1; // degrees, at the beginning of a path
  // Peak derivatives of the law s(t) = t^3 (10 - 15 t + 6 t^2), 0 <= t <= 1.
  private static final double MOST_SPEED = 1.875;
  private static final double MOST_ACCELERATION = 5.7736;

  final double seconds;
  private final double[][] joints = new double[SAMPLES + 1][];

  /** Moves all joints so that they begin and end together. `t`: shortest duration. */
  static Motion free(double[] from, double[] to, Limits limits, double t) throws Unreachable, LimitExceeded {
    double[] shares = Arrays.stream(limits.joints).map(share -> share * limits.share).toArray();
    return new Motion(s -> between(from, to, s), 0, new Limits(1, shares), t);
  }

  /** Refuses a line if the arm is folded back at the beginning, since Arm.joints() has no such pose. */
  static Motion line(double[] from, Point to, Limits limits, double t) throws Unreachable, LimitExceeded {
    Arm.Tool tool = Arm.tool(from);
    double[] a = {tool.x(), tool.y(), tool.z(), tool.pitch()};
    double[] b = {to.x, to.y, to.z, Arm.LEVEL};
    Way way = s -> {
      double[] at = between(a, b, s);
      return Arm.joints(new Arm.Tool(at[0], at[1], at[2], at[3]));
    };
    double[] first = way.at(0);
    for (int joint = 0; joint < Arm.DOF; joint++) {
      if (Math.abs(first[joint] - from[joint]) > JUMP) {
        throw new Unreachable(tool.point(), "no line begins here: the arm is folded back, Move it first");
      }
    }
    double length = Math.hypot(Math.hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]);
    return new Motion(way, length, limits, t);
  }

  static Motion arc(Arc arc, Limits limits) throws Unreachable, LimitExceeded {
    return new Motion(s -> Arm.joints(new Arm.Tool(arc.at(s), Arm.LEVEL)), arc.length, limits, 0);
  }

  /** `length`: of a line or an arc, metres. */
  private Motion(Way way, double length, Limits limits, double t) throws Unreachable, LimitExceeded {
    for (int i = 0; i <= SAMPLES; i++) {
      joints[i] = way.at((double) i / SAMPLES);
    }
    double least = Math.max(t, leastSeconds(length, limits.share * Arm.LINE_SPEED, 0, Arm.LINE_ACCELERATION));
    for (int joint = 0; joint < Arm.DOF; joint++) {
      for (int i = 1; i < SAMPLES; i++) {
        double before = joints[i - 1][joint];
        double after = joints[i + 1][joint];
        double slope = Math.abs(after - before) * SAMPLES / 2;
        double bend = Math.abs(after - 2 * joints[i][joint] + before) * SAMPLES * SAMPLES;
        double acceleration = Arm.JOINTS[joint].acceleration();
        least = Math.max(least, leastSeconds(slope, limits.joint(joint), bend, acceleration));
      }
    }
    seconds = least;
  }

  double[] at(double time) {
    double t = seconds > 0 ? Math.min(time / seconds, 1) : 1;
    double sample = t * t * t * (10 + t * (6 * t - 15)) * SAMPLES;
    int i = Math.min((int) sample, SAMPLES - 1);
    return between(joints[i], joints[i + 1], sample - i);
  }

  private static double[] between(double[] from, double[] to, double s) {
    double[] at = new double[from.length];
    for (int i = 0; i < from.length; i++) {
      at[i] = from[i] + s * (to[i] - from[i]);
    }
    return at;
  }

  private static double leastSeconds(double slope, double speed, double bend, double acceleration) {
    double bySpeed = MOST_SPEED * slope / speed;
    double byAcceleration = (MOST_ACCELERATION * slope + MOST_SPEED * MOST_SPEED * bend) / acceleration;
    return Math.max(bySpeed, Math.sqrt(byAcceleration));
  }
}
