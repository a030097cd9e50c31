// SPDX-License-Identifier: Apache-2.0
import java.util.Properties;
import org.jacorb.orb.ORB;
import org.omg.PortableServer.POA;
import org.omg.PortableServer.POAHelper;

/** Serves a Lynx 5 that has only the interface of robot.idl: robot SERVO_SOCKET PORT KEY */
public final class Main {
  private static final String HOST = "127.0.0.1";

  public static void main(String[] arguments) throws Exception {
    if (arguments.length != 3) {
      System.err.println("usage: robot SERVO_SOCKET PORT KEY");
      System.exit(2);
    }
    String port = arguments[1];
    String key = arguments[2];
    Properties properties = new Properties();
    properties.put("org.omg.CORBA.ORBClass", "org.jacorb.orb.ORB");
    properties.put("org.omg.CORBA.ORBSingletonClass", "org.jacorb.orb.ORBSingleton");
    properties.put("OAAddress", "iiop://" + HOST + ":" + port);
    // Every waiting motion has a thread, and reads need one, too.
    properties.put("jacorb.poa.thread_pool_max", "32");
    ORB orb = (ORB) org.omg.CORBA.ORB.init(new String[0], properties);
    POA poa = POAHelper.narrow(orb.resolve_initial_references("RootPOA"));
    Servant servant = new Servant(new Controller(arguments[0]));
    servant.Status(); // reads the position of the arm, if a controller is connected
    orb.addObjectKey(key, orb.object_to_string(poa.servant_to_reference(servant))); // for a corbaloc
    poa.the_POAManager().activate();
    System.out.println("ready corbaloc::" + HOST + ":" + port + "/" + key);
    orb.run();
  }
}
