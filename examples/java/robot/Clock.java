// SPDX-License-Identifier: Apache-2.0
import java.util.concurrent.locks.LockSupport;

final class Clock {
  static void sleepUntil(long nanoTime) {
    for (long left; (left = nanoTime - System.nanoTime()) > 0;) {
      LockSupport.parkNanos(left);
    }
  }

  private Clock() {}
}
