// SPDX-License-Identifier: Apache-2.0
import Corbot.BadParameter;
import Corbot.LimitExceeded;
import Corbot.NotReady;
import Corbot.QueueFull;
import Corbot.Robot;
import Corbot.RobotHelper;
import Corbot.Stopped;
import Corbot.Unreachable;
import java.util.Properties;
import org.omg.CORBA.ORB;
import org.omg.CORBA.UserException;

/** Takes a piece from one place to another with any robot that has robot.idl: pick_and_place REFERENCE */
public final class PickAndPlace {
  private static final double[] FROM = {0.20, 0.10, 0.03};
  private static final double[] TO = {0.20, -0.10, 0.03};
  private static final double ABOVE = 0.06;
  private static final double SETTLE = 0.1; // seconds, before the gripper moves

  private static void carry(Robot robot)
      throws BadParameter, Unreachable, LimitExceeded, NotReady, Stopped, QueueFull {
    robot.Open();
    robot.Move(FROM[0], FROM[1], FROM[2], ABOVE, 0);
    robot.MoveS(FROM[0], FROM[1], FROM[2], 0, 0);
    robot.Delay(SETTLE);
    robot.Close();
    robot.MoveS(FROM[0], FROM[1], FROM[2], ABOVE, 0);
    robot.Move(TO[0], TO[1], TO[2], ABOVE, 0);
    robot.MoveS(TO[0], TO[1], TO[2], 0, 0);
    robot.Delay(SETTLE);
    robot.Open();
    robot.MoveS(TO[0], TO[1], TO[2], ABOVE, 0);
  }

  public static void main(String[] arguments) {
    Properties properties = new Properties();
    properties.put("org.omg.CORBA.ORBClass", "org.jacorb.orb.ORB");
    properties.put("org.omg.CORBA.ORBSingletonClass", "org.jacorb.orb.ORBSingleton");
    ORB orb = ORB.init(new String[0], properties);
    try {
      carry(RobotHelper.narrow(orb.string_to_object(arguments[0])));
      System.out.println("the piece is there");
    } catch (Unreachable e) {
      System.err.printf("(%.3f, %.3f, %.3f) m is out of reach: %s%n",
          e.target.x, e.target.y, e.target.z, e.reason);
      System.exit(1);
    } catch (UserException e) {
      System.err.println("the robot refused: " + e);
      System.exit(1);
    }
    System.exit(0);
  }
}
