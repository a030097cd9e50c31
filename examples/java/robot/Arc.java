// SPDX-License-Identifier: Apache-2.0
import Corbot.BadParameter;
import Corbot.Point;

/** The arc from one point through a second one to a third. */
final class Arc {
  private static final double FLAT = 1e-6; // of the triangle, like in docs/kinematics.md

  final double length;
  // In the plane of the points, p1 is the origin, u the direction to p2, and v perpendicular to it on p3's
  // side.
  private final Point origin;
  private final double[] u;
  private final double[] v;
  private final double centreU;
  private final double centreV;
  private final double radius;
  private final double begin;
  private final double angle;

  Arc(Point p1, Point p2, Point p3) throws BadParameter {
    origin = p1;
    double[] a = {p2.x - p1.x, p2.y - p1.y, p2.z - p1.z};
    double[] b = {p3.x - p1.x, p3.y - p1.y, p3.z - p1.z};
    double au = Math.sqrt(dot(a, a));
    u = sum(1 / au, a, 0, a);
    double bu = dot(b, u);
    double[] across = sum(1, b, -bu, u);
    double bv = Math.sqrt(dot(across, across));
    double longest = Math.max(Math.max(au * au, bu * bu + bv * bv), (bu - au) * (bu - au) + bv * bv);
    if (!(au * bv > FLAT * longest)) {
      throw new BadParameter("P2", bv, "the three points define no arc");
    }
    v = sum(1 / bv, across, 0, a);
    centreU = au / 2;
    centreV = (bu * bu + bv * bv - au * bu) / (2 * bv);
    radius = Math.hypot(centreU, centreV);
    begin = Math.atan2(-centreV, -centreU);
    double turn = Math.atan2(bv - centreV, bu - centreU) - begin;
    angle = turn > 0 ? turn : turn + 2 * Math.PI;
    length = angle * radius;
  }

  Point at(double s) {
    double alongU = centreU + radius * Math.cos(begin + s * angle);
    double alongV = centreV + radius * Math.sin(begin + s * angle);
    double[] offset = sum(alongU, u, alongV, v);
    return new Point(origin.x + offset[0], origin.y + offset[1], origin.z + offset[2]);
  }

  private static double dot(double[] a, double[] b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }

  private static double[] sum(double m, double[] a, double n, double[] b) {
    return new double[] {m * a[0] + n * b[0], m * a[1] + n * b[1], m * a[2] + n * b[2]};
  }
}
