// SPDX-License-Identifier: Apache-2.0
import Corbot.BadParameter;
import Corbot.CartesianCoord;
import Corbot.GripperState;
import Corbot.JointRange;
import Corbot.LimitExceeded;
import Corbot.NotReady;
import Corbot.Point;
import Corbot.QueueFull;
import Corbot.RobotKind;
import Corbot.RobotPOA;
import Corbot.RobotState;
import Corbot.Unreachable;
import java.io.IOException;
import java.util.Arrays;
import java.util.concurrent.Semaphore;
import java.util.concurrent.atomic.AtomicInteger;

/** Implements all of Corbot::Robot, as robot.idl describes it. */
final class Servant extends RobotPOA {
  private static final int CAPACITY = 16;
  private static final int FRAMES_PER_SECOND = 50; // the rate at which a servo reads its pulse
  private static final double LONGEST_DELAY = 3600;

  private final Controller controller;
  private final AtomicInteger accepted = new AtomicInteger();
  private final Semaphore turn = new Semaphore(1, true); // fair: in the order of arrival

  // Guarded by `this`: the set-points, and percentages of the limits.
  private double[] q = new double[Arm.DOF];
  private double grip = Arm.GRIPPER_CLOSED;
  private boolean isOpen;
  private double share = 1;
  private final double[] jointShares = new double[Arm.DOF];

  Servant(Controller controller) {
    this.controller = controller;
    Arrays.fill(jointShares, 1);
  }

  // --- Attributes: none waits for a motion ---

  @Override
  public synchronized double[] ArtiCoord() {
    return q.clone();
  }

  @Override
  public CartesianCoord CartCoord() {
    double[] at = ArtiCoord();
    Arm.Tool tool = Arm.tool(at);
    return new CartesianCoord(tool.x(), tool.y(), tool.z(), at[0], tool.pitch(), 0);
  }

  @Override
  public synchronized GripperState GripperStatus() {
    return isOpen ? GripperState.Open : GripperState.Close;
  }

  @Override
  public RobotState Status() {
    if (accepted.get() > 0) {
      return RobotState.Waiting;
    }
    try {
      connect();
      return RobotState.Standby;
    } catch (NotReady e) {
      return RobotState.Error;
    }
  }

  @Override
  public RobotKind RobotType() {
    return RobotKind.Anthropomorphic;
  }

  @Override
  public int DoF() {
    return Arm.DOF;
  }

  @Override
  public JointRange[] MovRange() {
    return Arm.ranges();
  }

  @Override
  public double Reach() {
    return Arm.REACH;
  }

  // --- Motions: each returns when it has ended ---

  @Override
  public void Move(double Px, double Py, double Pz, double d, double t)
      throws BadParameter, Unreachable, LimitExceeded, NotReady, QueueFull {
    checkTarget(Px, Py, Pz, d, t);
    Motion.Limits limits = limits();
    try (Turn mine = new Turn()) {
      double[] target = Arm.joints(new Arm.Tool(Px, Py, Pz + d, Arm.LEVEL));
      carryOut(Motion.free(ArtiCoord(), target, limits, t));
    }
  }

  @Override
  public void MoveS(double Px, double Py, double Pz, double d, double t)
      throws BadParameter, Unreachable, LimitExceeded, NotReady, QueueFull {
    checkTarget(Px, Py, Pz, d, t);
    Motion.Limits limits = limits();
    try (Turn mine = new Turn()) {
      carryOut(Motion.line(ArtiCoord(), new Point(Px, Py, Pz + d), limits, t));
    }
  }

  @Override
  public void MoveC(Point P1, Point P2, Point P3)
      throws BadParameter, Unreachable, LimitExceeded, NotReady, QueueFull {
    checkFinite("P1", P1.x, P1.y, P1.z);
    checkFinite("P2", P2.x, P2.y, P2.z);
    checkFinite("P3", P3.x, P3.y, P3.z);
    Arc arc = new Arc(P1, P2, P3);
    Motion.Limits limits = limits();
    try (Turn mine = new Turn()) {
      Motion approach = Motion.line(ArtiCoord(), P1, limits, 0);
      Motion round = Motion.arc(arc, limits);
      carryOut(approach); // both are possible
      carryOut(round);
    }
  }

  @Override
  public void Drive(int articulation, double increment, double speed)
      throws BadParameter, LimitExceeded, NotReady, QueueFull {
    checkJoint(articulation);
    checkFinite("increment", increment);
    check(Double.isFinite(speed) && speed > 0, "speed", speed, "must be above 0");
    double most = limits().joint(articulation);
    if (speed > most) {
      throw new LimitExceeded("speed", articulation, speed, 0, most);
    }
    double[] shares = new double[Arm.DOF];
    Arrays.fill(shares, speed / Arm.JOINTS[articulation].speed());
    try (Turn mine = new Turn()) {
      double[] target = ArtiCoord();
      target[articulation] += increment;
      drive(Arm.inRange(target), new Motion.Limits(1, shares));
    }
  }

  @Override
  public void Ready() throws NotReady, QueueFull {
    Motion.Limits limits = limits();
    try (Turn mine = new Turn()) {
      drive(new double[Arm.DOF], limits);
    }
  }

  @Override
  public void Delay(double t) throws BadParameter, NotReady, QueueFull {
    check(t >= 0 && t <= LONGEST_DELAY, "t", t, "must be from 0 to 3600 s");
    try (Turn mine = new Turn()) {
      Clock.sleepUntil(System.nanoTime() + (long) (1e9 * t));
    }
  }

  @Override
  public void Open() throws NotReady, QueueFull {
    grip(true);
  }

  @Override
  public void Close() throws NotReady, QueueFull {
    grip(false);
  }

  // --- Limits of the motions that are accepted from now on ---

  @Override
  public synchronized void Speed(double percent) throws BadParameter {
    checkPercent(percent);
    share = percent / 100;
  }

  @Override
  public synchronized void ArtSpeed(int articulation, double percent) throws BadParameter {
    checkJoint(articulation);
    checkPercent(percent);
    jointShares[articulation] = percent / 100;
  }

  @Override
  public synchronized void AllSpeed(double percent) throws BadParameter {
    checkPercent(percent);
    Arrays.fill(jointShares, percent / 100);
  }

  // --- The parts ---

  /** The turn of a motion, from its acceptance to its end; waits for earlier motions. */
  private final class Turn implements AutoCloseable {
    Turn() throws NotReady, QueueFull {
      if (accepted.incrementAndGet() > CAPACITY) {
        accepted.decrementAndGet();
        throw new QueueFull(CAPACITY);
      }
      turn.acquireUninterruptibly();
      try {
        connect();
      } catch (NotReady e) {
        close();
        throw e;
      }
    }

    @Override
    public void close() {
      turn.release();
      accepted.decrementAndGet();
    }
  }

  /** Takes the arm's position from the controller's last commands after a new line is open. */
  private synchronized void connect() throws NotReady {
    if (controller.isConnected()) {
      return;
    }
    try {
      double[] pulses = controller.connect(Arm.DOF + 1);
      for (int joint = 0; joint < Arm.DOF; joint++) {
        q[joint] = Arm.angle(joint, pulses[joint]);
      }
      grip = pulses[Arm.DOF];
      isOpen = grip < (Arm.GRIPPER_OPEN + Arm.GRIPPER_CLOSED) / 2;
    } catch (IOException e) {
      throw notReady(e);
    }
  }

  private static NotReady notReady(IOException e) {
    return new NotReady("the servo controller: " + e.getMessage());
  }

  private interface Frame {
    /** Sets the state at that time; returns the pulses of what moves. */
    double[] at(double time);
  }

  /** Sends every frame until the end, to the channel `first` and the next ones. */
  private void carryOut(double seconds, int first, Frame frame) throws NotReady {
    long begin = System.nanoTime();
    double time = 0;
    for (int i = 1; time < seconds; i++) {
      Clock.sleepUntil(begin + i * 1_000_000_000L / FRAMES_PER_SECOND);
      time = Math.min((System.nanoTime() - begin) / 1e9, seconds);
      synchronized (this) {
        try {
          controller.send(first, frame.at(time));
        } catch (IOException e) {
          throw notReady(e);
        }
      }
    }
  }

  private void carryOut(Motion motion) throws NotReady {
    carryOut(motion.seconds, 0, time -> Arm.pulses(q = motion.at(time)));
  }

  private void drive(double[] target, Motion.Limits limits) throws NotReady {
    try {
      carryOut(Motion.free(ArtiCoord(), target, limits, 0));
    } catch (Unreachable | LimitExceeded e) {
      throw new IllegalStateException(e); // any pose between two poses in range is in range
    }
  }

  private void grip(boolean open) throws NotReady, QueueFull {
    try (Turn mine = new Turn()) {
      double from = grip;
      double to = open ? Arm.GRIPPER_OPEN : Arm.GRIPPER_CLOSED;
      synchronized (this) {
        isOpen = open;
      }
      // The arm gets no pulse: after a new start its position is known to 5 us, and it would jump.
      carryOut(Arm.GRIPPER_SECONDS, Arm.DOF,
          time -> new double[] {grip = from + time / Arm.GRIPPER_SECONDS * (to - from)});
    }
  }

  private synchronized Motion.Limits limits() {
    return new Motion.Limits(share, jointShares.clone());
  }

  private static void check(boolean isGood, String parameter, double value, String rule) throws BadParameter {
    if (!isGood) {
      throw new BadParameter(parameter, value, rule);
    }
  }

  private static void checkPercent(double percent) throws BadParameter {
    check(percent > 0 && percent <= 100, "percent", percent, "must be above 0, at most 100");
  }

  private static void checkJoint(int articulation) throws BadParameter {
    check(articulation >= 0 && articulation < Arm.DOF, "articulation", articulation, "must be 0 to 3");
  }

  private static void checkFinite(String parameter, double... values) throws BadParameter {
    for (double value : values) {
      check(Double.isFinite(value), parameter, value, "must be a finite number");
    }
  }

  private static void checkTarget(double x, double y, double z, double d, double t) throws BadParameter {
    checkFinite("Px", x);
    checkFinite("Py", y);
    checkFinite("Pz", z);
    checkFinite("d", d);
    check(Double.isFinite(t) && t >= 0, "t", t, "must be 0 or more");
  }
}
