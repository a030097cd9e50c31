// SPDX-License-Identifier: Apache-2.0
// Test client of Corbot::Arm over JacORB: reads a command a line, answers each with one line. It knows no
// operation by name; argument and result types are found by reflection over the stub classes.

import Corbot.Arm;
import Corbot.ArmHelper;
import Corbot.ArmOperations;
import java.io.BufferedReader;
import java.io.IOException;
import java.io.InputStreamReader;
import java.io.PrintStream;
import java.lang.reflect.Array;
import java.lang.reflect.Field;
import java.lang.reflect.InvocationTargetException;
import java.lang.reflect.Method;
import java.lang.reflect.Modifier;
import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Deque;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import java.util.NoSuchElementException;
import java.util.concurrent.CompletableFuture;
import java.util.concurrent.Executor;
import java.util.regex.Matcher;
import java.util.regex.Pattern;
import java.util.stream.Collectors;
import java.util.stream.IntStream;
import org.omg.CORBA.ORB;
import org.omg.CORBA.SystemException;
import org.omg.CORBA.UserException;
import org.omg.CORBA.portable.ObjectImpl;
import org.omg.CosNaming.NamingContextExtHelper;

public final class Client {
  private static final Pattern COMMAND = Pattern.compile("\\s*(\\S*)\\s*(\\S*)\\s*(.*)");
  private static final Executor THREADS = task -> new Thread(task).start();

  private final ORB orb = ORB.init(new String[0], null);
  private final Map<String, CompletableFuture<String>> begun = new HashMap<>();
  private Arm arm;

  public static void main(String[] arguments) throws IOException {
    PrintStream answers = System.out;
    System.setOut(System.err);
    System.setProperty("org.omg.CORBA.ORBClass", "org.jacorb.orb.ORB");
    System.setProperty("org.omg.CORBA.ORBSingletonClass", "org.jacorb.orb.ORBSingleton");
    // A request that JacORB writes while it finds the connection's end is forgotten: its caller waits for
    // ever.
    System.setProperty("jacorb.connection.client.pending_reply_timeout", "20000");
    Client client = new Client();
    BufferedReader commands = new BufferedReader(new InputStreamReader(System.in));
    for (String line; (line = commands.readLine()) != null;) {
      answers.println(client.answer(line).replace('\n', ' '));
      answers.flush();
    }
    System.exit(0);
  }

  private String answer(String line) {
    Matcher command = COMMAND.matcher(line);
    command.matches();
    String first = command.group(2);
    String rest = command.group(3);
    try {
      switch (command.group(1)) {
        case "connect":
          arm = ArmHelper.narrow(orb.string_to_object(first));
          return "ok";
        case "resolve":
          arm = ArmHelper.narrow(
              NamingContextExtHelper.narrow(orb.string_to_object(first)).resolve_str(rest));
          return "ok";
        case "get":
          return attribute(first).run();
        case "call":
          return operation(first + " " + rest).run();
        case "begin":
          begun.put(first, CompletableFuture.supplyAsync(operation(rest)::run, THREADS));
          return "ok";
        case "end":
          CompletableFuture<String> call = begun.remove(first);
          return call == null ? "error nothing was begun as " + first : call.join();
        default:
          return "error no command " + command.group(1);
      }
    } catch (SystemException | UserException e) {
      return exception(e);
    } catch (NoSuchElementException e) {
      return "error too few arguments";
    } catch (IllegalArgumentException | ReflectiveOperationException e) {
      return "error " + e.getMessage();
    }
  }

  // A method of the stub with its arguments.
  private record Call(Arm arm, Method method, Object[] arguments) {
    String run() {
      try {
        Object result = method.invoke(arm, arguments);
        return method.getReturnType() == void.class ? "ok" : "ok " + text(result);
      } catch (InvocationTargetException e) {
        return exception(e.getCause());
      } catch (ReflectiveOperationException e) {
        return "error " + e;
      }
    }
  }

  private Call attribute(String name) {
    Method method = method(name);
    if (method.getReturnType() == void.class || method.getParameterCount() != 0) {
      throw new IllegalArgumentException(name + " is no attribute");
    }
    return new Call(arm, method, new Object[0]);
  }

  private Call operation(String text) throws ReflectiveOperationException {
    Deque<String> words =
        new ArrayDeque<>(List.of(text.replaceAll("[{}\\[\\]]", " $0 ").trim().split("\\s+")));
    Method method = method(words.removeFirst());
    List<Object> arguments = new ArrayList<>();
    for (Class<?> type : method.getParameterTypes()) {
      arguments.add(value(type, words));
    }
    if (!words.isEmpty()) {
      throw new IllegalArgumentException("too many arguments");
    }
    return new Call(arm, method, arguments.toArray());
  }

  private Method method(String name) {
    if (arm == null) {
      throw new IllegalArgumentException("not connected");
    }
    return Arrays.stream(ArmOperations.class.getMethods()).filter(m -> m.getName().equals(name)).findAny()
        .orElseThrow(() -> new IllegalArgumentException("no operation or attribute " + name));
  }

  // Takes an argument of this type off the words. All 64-bit integers of the interface are unsigned.
  private static Object value(Class<?> type, Deque<String> words) throws ReflectiveOperationException {
    if (type == double.class) {
      return number(words.removeFirst());
    }
    if (type == int.class) {
      return Integer.valueOf(words.removeFirst());
    }
    if (type == String.class) {
      return words.removeFirst();
    }
    if (type == long.class) {
      return Long.parseUnsignedLong(words.removeFirst());
    }
    if (type.isArray()) {
      List<Object> elements = new ArrayList<>();
      expect("[", words);
      while (!words.getFirst().equals("]")) {
        elements.add(value(type.getComponentType(), words));
      }
      expect("]", words);
      Object array = Array.newInstance(type.getComponentType(), elements.size());
      IntStream.range(0, elements.size()).forEach(i -> Array.set(array, i, elements.get(i)));
      return array;
    }
    if (fields(type).isEmpty()) { // an enumeration
      return type.getField(words.removeFirst()).get(null);
    }
    Object struct = type.getConstructor().newInstance();
    expect("{", words);
    for (Field field : fields(type)) {
      field.set(struct, value(field.getType(), words));
    }
    expect("}", words);
    return struct;
  }

  private static void expect(String bracket, Deque<String> words) {
    String word = words.removeFirst();
    if (!word.equals(bracket)) {
      throw new IllegalArgumentException("expected " + bracket + " instead of " + word);
    }
  }

  private static double number(String word) {
    return switch (word) {
      case "nan" -> Double.NaN;
      case "inf" -> Double.POSITIVE_INFINITY;
      case "-inf" -> Double.NEGATIVE_INFINITY;
      default -> Double.parseDouble(word);
    };
  }

  private static String text(Object value) {
    if (value instanceof Double) {
      return value.toString().replace("NaN", "nan").replace("Infinity", "inf");
    }
    if (value instanceof Long) {
      return Long.toUnsignedString((Long) value);
    }
    if (value instanceof String) {
      return '"' + ((String) value).replace("\\", "\\\\").replace("\"", "\\\"") + '"';
    }
    if (value instanceof ObjectImpl) {
      return ((ObjectImpl) value)._orb().object_to_string((ObjectImpl) value);
    }
    if (value.getClass().isArray()) {
      return IntStream.range(0, Array.getLength(value)).mapToObj(i -> text(Array.get(value, i)))
          .collect(Collectors.joining(" ", "[", "]"));
    }
    return fields(value.getClass()).isEmpty() ? value.toString() : members(value);
  }

  private static String exception(Throwable e) {
    if (e instanceof SystemException) {
      return "exception SYSTEM:" + e.getClass().getSimpleName();
    }
    return "exception " + e.getClass().getSimpleName() + " " + members(e);
  }

  private static String members(Object struct) {
    List<String> members = new ArrayList<>();
    try {
      for (Field field : fields(struct.getClass())) {
        members.add(field.getName() + "=" + text(field.get(struct)));
      }
    } catch (IllegalAccessException e) {
      throw new IllegalStateException(e);
    }
    return "{" + String.join(" ", members) + "}";
  }

  // The members of an IDL struct or exception; none of a basic type or an enumeration.
  private static List<Field> fields(Class<?> type) {
    return Arrays.stream(type.getDeclaredFields())
        .filter(field -> Modifier.isPublic(field.getModifiers()) && !Modifier.isStatic(field.getModifiers()))
        .toList();
  }
}
