// SPDX-License-Identifier: Apache-2.0
import Corbot.JointRange;
import Corbot.LimitExceeded;
import Corbot.Point;
import Corbot.Unreachable;
import java.util.Arrays;

/** The Lynx 5 of profiles/cell/arm.toml. Metres, degrees, microseconds; equations: docs/kinematics.md. */
final class Arm {
  /** A joint. Its servo is at `zero` + `perDegree` * angle; limits are in degrees and seconds. */
  record Joint(
      double lower, double upper, double speed, double acceleration, double zero, double perDegree) {}

  static final Joint[] JOINTS = {
    new Joint(-90, 90, 180, 900, 1500, 10), // base
    new Joint(-30, 130, 150, 800, 1000, 10), // shoulder
    new Joint(-30, 150, 180, 900, 2100, -10), // elbow
    new Joint(-50, 140, 200, 1000, 1050, 10), // wrist
  };
  static final int DOF = JOINTS.length;
  static final double GRIPPER_OPEN = 1100;
  static final double GRIPPER_CLOSED = 1900;
  static final double GRIPPER_SECONDS = 0.5;
  static final double LINE_SPEED = 0.25;
  static final double LINE_ACCELERATION = 1;
  static final double LEVEL = 0; // the tool's pitch in motions to a point
  static final double REACH = 0.340; // length of the three links, stretched

  private static final double L0 = 0.067; // table to shoulder
  private static final double L1 = 0.120;
  private static final double L2 = 0.120;
  private static final double L3 = 0.100; // wrist to tool centre point
  private static final double SHOULDER_OFFSET = 10;
  private static final double WRIST_OFFSET = -45;
  private static final double ROUNDING = 1e-9;

  /** The tool centre point, and the angle by which the tool points upward. */
  record Tool(double x, double y, double z, double pitch) {
    Tool(Point p, double pitch) {
      this(p.x, p.y, p.z, pitch);
    }

    Point point() {
      return new Point(x, y, z);
    }
  }

  static Tool tool(double[] q) {
    double upper = q[1] + SHOULDER_OFFSET;
    double forearm = upper - q[2];
    double pitch = forearm + q[3] + WRIST_OFFSET;
    double r = L1 * cos(upper) + L2 * cos(forearm) + L3 * cos(pitch);
    double z = L0 + L1 * sin(upper) + L2 * sin(forearm) + L3 * sin(pitch);
    return new Tool(r * cos(q[0]), r * sin(q[0]), z, pitch);
  }

  /** Returns the joints with the arm towards the tool and the elbow up, the only solution used here. */
  static double[] joints(Tool tool) throws Unreachable, LimitExceeded {
    double u = Math.hypot(tool.x, tool.y) - L3 * cos(tool.pitch);
    double h = tool.z - L0 - L3 * sin(tool.pitch);
    double bend = (u * u + h * h - L1 * L1 - L2 * L2) / (2 * L1 * L2);
    if (Math.abs(bend) > 1 + ROUNDING) {
      throw new Unreachable(tool.point(), "the wrist would be " + (bend > 0 ? "too far from" : "too near to")
          + " the shoulder");
    }
    double elbow = Math.toDegrees(Math.acos(Math.max(-1, Math.min(1, bend))));
    double upper = atan2(h, u) + atan2(L2 * sin(elbow), L1 + L2 * cos(elbow));
    double wrist = tool.pitch - upper + elbow - WRIST_OFFSET;
    return inRange(atan2(tool.y, tool.x), upper - SHOULDER_OFFSET, elbow, wrist);
  }

  static double[] inRange(double... q) throws LimitExceeded {
    for (int i = 0; i < DOF; i++) {
      if (q[i] < JOINTS[i].lower - ROUNDING || q[i] > JOINTS[i].upper + ROUNDING) {
        throw new LimitExceeded("joint range", i, q[i], JOINTS[i].lower, JOINTS[i].upper);
      }
    }
    return q;
  }

  static JointRange[] ranges() {
    return Arrays.stream(JOINTS)
        .map(joint -> new JointRange(joint.lower, joint.upper))
        .toArray(JointRange[]::new);
  }

  static double[] pulses(double[] q) {
    double[] pulses = new double[DOF];
    for (int i = 0; i < DOF; i++) {
      pulses[i] = JOINTS[i].zero + JOINTS[i].perDegree * q[i];
    }
    return pulses;
  }

  static double angle(int joint, double pulse) {
    return (pulse - JOINTS[joint].zero) / JOINTS[joint].perDegree;
  }

  private static double sin(double degrees) {
    return Math.sin(Math.toRadians(degrees));
  }

  private static double cos(double degrees) {
    return Math.cos(Math.toRadians(degrees));
  }

  private static double atan2(double y, double x) {
    return Math.toDegrees(Math.atan2(y, x));
  }

  private Arm() {}
}
