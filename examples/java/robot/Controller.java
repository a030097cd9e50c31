// SPDX-License-Identifier: Apache-2.0
import java.io.IOException;
import java.net.StandardProtocolFamily;
import java.net.UnixDomainSocketAddress;
import java.nio.ByteBuffer;
import java.nio.channels.SocketChannel;
import java.nio.charset.StandardCharsets;

/**
 * An SSC-32 servo controller at a Unix socket, as the scene of a cell emulates it. A pulse is a position
 * without a time, so the servos stop as soon as no more pulses come.
 */
final class Controller {
  private static final long REPLY_MS = 500;
  private static final int QP_UNIT_US = 10;
  private static final int NEVER_MOVED_US = 500; // or less: the controller does not know the servo's position
  private static final int MIDDLE_US = 1500; // then the scene's servos are here

  private final String path;
  private SocketChannel line;

  Controller(String path) {
    this.path = path;
  }

  /** Returns true if a device is connected; a read detects a closed line. */
  synchronized boolean isConnected() {
    try {
      if (line == null || line.read(ByteBuffer.allocate(64)) >= 0) {
        return line != null;
      }
    } catch (IOException e) {
      // Closed below.
    }
    close();
    return false;
  }

  /** Opens the line; returns the last pulses of the channels 0 to `count` - 1. */
  synchronized double[] connect(int count) throws IOException {
    try {
      line = SocketChannel.open(StandardProtocolFamily.UNIX);
      line.connect(UnixDomainSocketAddress.of(path));
      line.configureBlocking(false);
      write("\033VER\r"); // an escape drops a command that was cut off
      StringBuilder version = new StringBuilder();
      for (int next; (next = read()) != '\r';) {
        version.append((char) next);
      }
      if (version.indexOf("SSC32") != 0) {
        throw new IOException("is no SSC-32");
      }
      double[] pulses = new double[count];
      for (int channel = 0; channel < count; channel++) {
        write("QP" + channel + "\r");
        int pulse = QP_UNIT_US * read(); // rounded down
        pulses[channel] = pulse > NEVER_MOVED_US ? pulse + QP_UNIT_US / 2 : MIDDLE_US;
      }
      return pulses;
    } catch (IOException e) {
      close();
      throw e;
    }
  }

  /** Sets the channel `first` and the next ones. */
  synchronized void send(int first, double... pulses) throws IOException {
    StringBuilder text = new StringBuilder();
    for (int i = 0; i < pulses.length; i++) {
      text.append('#').append(first + i).append('P').append(Math.round(pulses[i]));
    }
    write(text.append('\r').toString());
  }

  private void write(String text) throws IOException {
    if (line == null) {
      throw new IOException("no connection");
    }
    ByteBuffer bytes = ByteBuffer.wrap(text.getBytes(StandardCharsets.US_ASCII));
    for (long end = System.currentTimeMillis() + REPLY_MS; bytes.hasRemaining();) {
      if (line.write(bytes) == 0) {
        pause(end);
      }
    }
  }

  private int read() throws IOException {
    ByteBuffer one = ByteBuffer.allocate(1);
    for (long end = System.currentTimeMillis() + REPLY_MS; one.hasRemaining();) {
      int count = line.read(one);
      if (count < 0) {
        throw new IOException("has hung up");
      }
      if (count == 0) {
        pause(end);
      }
    }
    return one.get(0) & 0xff;
  }

  private static void pause(long end) throws IOException {
    if (System.currentTimeMillis() > end) {
      throw new IOException("does not respond");
    }
    Clock.sleepUntil(System.nanoTime() + 1_000_000);
  }

  private void close() {
    try {
      if (line != null) {
        line.close();
      }
    } catch (IOException e) {
      // The line is not used any more.
    }
    line = null;
  }
}
