// SPDX-License-Identifier: Apache-2.0
import Corbot.BadParameter;
import Corbot.Point;

/** The arc from one point through a second one to a third. */
final class Arc {
  private static final double FLAT = 1e-6; // of the triangle, as in docs/kinematics.md

  final double length;
  private final double[] centre;
  private final double[] first; // from the centre to the begin
  private final double[] second; // at right angles to it, of the same length
  private final double angle;

  Arc(Point p1, Point p2, Point p3) throws BadParameter {
    double[] a = minus(vector(p2), vector(p1));
    double[] b = minus(vector(p3), vector(p1));
    double[] normal = cross(a, b);
    double longest = Math.max(Math.max(dot(a, a), dot(b, b)), dot(minus(b, a), minus(b, a)));
    double area = Math.sqrt(dot(normal, normal)); // twice the triangle's
    if (!(area > FLAT * longest)) {
      throw new BadParameter("P2", area, "the three points define no arc");
    }
    // https://en.wikipedia.org/wiki/Circumcircle#Cartesian_coordinates_from_cross-_and_dot-products
    double[] to = cross(minus(scaled(b, dot(a, a)), scaled(a, dot(b, b))), normal);
    first = scaled(to, -1 / (2 * area * area));
    centre = minus(vector(p1), first);
    second = cross(scaled(normal, 1 / area), first);
    double[] end = minus(vector(p3), centre);
    double turn = Math.atan2(dot(end, second), dot(end, first));
    angle = turn > 0 ? turn : turn + 2 * Math.PI;
    length = angle * Math.sqrt(dot(first, first));
  }

  Point at(double s) {
    double c = Math.cos(s * angle);
    double d = Math.sin(s * angle);
    return new Point(centre[0] + c * first[0] + d * second[0], centre[1] + c * first[1] + d * second[1],
        centre[2] + c * first[2] + d * second[2]);
  }

  private static double[] vector(Point p) {
    return new double[] {p.x, p.y, p.z};
  }

  private static double[] minus(double[] a, double[] b) {
    return new double[] {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  }

  private static double[] scaled(double[] a, double by) {
    return new double[] {by * a[0], by * a[1], by * a[2]};
  }

  private static double dot(double[] a, double[] b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }

  private static double[] cross(double[] a, double[] b) {
    return new double[] {
      a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
}
