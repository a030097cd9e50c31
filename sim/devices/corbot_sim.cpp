// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <set>
#include <string>

#include "corbot/standard_streams.h"
#include "sim/devices/cia402_server.h"
#include "sim/devices/maestro_device.h"
#include "sim/devices/node_commands.h"
#include "sim/devices/sim_server.h"
#include "sim/devices/ssc32_device.h"

namespace {

using namespace corbot::sim;

constexpr int kExitFailure = 1;
constexpr int kExitUsage = 2;

constexpr const char* kFooter = R"(Example:
  corbot-sim ssc32 --model ssc32u --pty /tmp/servos --record pulses.csv
  The robot's profile then names /tmp/servos as its serial line, at 115200 baud.

Prints 'ready LINK' when the device can be opened, and serves until SIGTERM or Ctrl-C; LINK is then removed.
Lines on standard input ask for faults; each is answered by a line 'ok ...' or 'error: ...':
  drop N          the next N bytes that come in vanish
  garble N        in the next N bytes that are answered all bits are flipped
  silent on|off   answers nothing, though it goes on working
  deaf QUERY on|off    one kind of query is not answered, the others are; an SSC-32 has position, moving,
                       version, input and analog, a Maestro position, moving and errors
  garble QUERY on|off  likewise; in its answers all bits are flipped
  half QUERY on|off    likewise; only the first half of the bytes leaves, of one byte none
  lose QUERY N         likewise; every N-th answer is lost; 0: none
  delay QUERY MS       likewise; its answers, and what comes after them, leave so much later; 0: no later
  batch MS        answers are handed over every MS milliseconds only, as an FTDI adapter does: 16 as it is
                  delivered, 1 with its latency timer set so; 0: at once
  power on|off    without power: no pulses, no answers, nothing is kept; the terminal stays, as an
                  adapter's does
  brownout MS     power off, and on again after so many milliseconds
  reset           power off and on: pulses off, the first move is a first move again
  unplug          the terminal is hung up and LINK removed
  plug            a new terminal under LINK ('ready LINK' once more)
  input X 0|1     puts digital input X (A, B, ...) to 0 V or 5 V; they begin at 5 V
  pulses          answers 'pulses CH=US ...', all channels that have a pulse, in microseconds
  late            answers 'late NS': by how much this program was late at most since this was asked last, with
                  --record; it then took what had come meanwhile at once, which no controller does
)";

constexpr const char* kCanFooter = R"(Example:
  corbot-sim cia402 --can unix:/tmp/can --nodes 5 --record counts.csv
  The robot's profile then names unix:/tmp/can as its CAN interface, and nodes 1 to 5.

unix:/PATH is a virtual bus: a socket (SOCK_SEQPACKET, a struct can_frame a packet) that any number of
programs may join; each receives from all others. Anything else is a CAN interface of this machine, such as
vcan0.

Prints 'ready BUS' when the bus can be joined, and serves until SIGTERM or Ctrl-C; the socket is then removed.
Lines on standard input ask for faults; each is answered by a line 'ok ...' or 'error: ...'.
  drop N                 the next N frames that come in vanish
  garble N               in the next N frames that are sent all bits of the data are flipped
  unplug                 the bus is cut and the socket removed
  plug                   the bus is there again ('ready BUS' once more)
  positions              answers 'positions NODE=COUNTS ...', where the shafts stand
  targets                answers 'targets NODE=COUNTS ...', what was commanded last
  states                 answers 'states NODE=STATE ...', as heartbeats tell it: 5 operational,
                         127 pre-operational
  help                   explains the commands to drives
To a drive, or, without NODE, to all:
)";

struct Settings {
  ServerOptions server;
  Cia402ServerOptions cia402;
  std::string model{"ssc32u"};
  std::string maestro_model{"mini"};
  Ssc32Options ssc32;
  MaestroOptions maestro;
};

void add_common(CLI::App& command, ServerOptions& server) {
  command.add_option("--pty", server.link, "Name for the terminal; an existing symbolic link is replaced")
      ->required()
      ->type_name("LINK");
  command.add_option("--baud", server.baud, "Speed of the line, kept in both directions")
      ->capture_default_str();
  command
      .add_option(
          "--record", server.record,
          "Writes time_ns (of the monotonic clock), channel, pulse_us and shaft_us, a row for each servo "
          "frame in which the pulse or the shaft of a channel has changed")
      ->type_name("FILE.csv");
}

/// Returns `word` if it stands where a device does and names none, else "".
std::string unknown_device(const CLI::App& app, const std::string& word) {
  if (word.starts_with('-')) return "";
  const auto devices = app.get_subcommands([](const CLI::App*) { return true; });
  const bool is_known = std::any_of(devices.begin(), devices.end(),
                                    [&](const CLI::App* device) { return device->check_name(word); });
  return is_known ? "" : word;
}

/// Checks that the makers provide this speed; throws CLI::ValidationError.
void check_baud(Ssc32Model model, int baud) {
  std::set<int> bauds{9600, 38400, 115200};
  if (model == Ssc32Model::kSsc32) bauds.insert(2400);
  if (!bauds.contains(baud)) {
    throw CLI::ValidationError(fmt::format("--baud: {} is not one of {}", baud, fmt::join(bauds, ", ")));
  }
}

CLI::App* add_ssc32(CLI::App& app, Settings& settings) {
  CLI::App* ssc32 = app.add_subcommand("ssc32", "Lynxmotion SSC-32 or SSC-32U");
  add_common(*ssc32, settings.server);
  ssc32->add_option("--model", settings.model, "Model of the controller")
      ->check(CLI::IsMember({"ssc32", "ssc32u"}))
      ->type_name("MODEL")
      ->capture_default_str();
  ssc32->footer(kFooter);
  return ssc32;
}

CLI::App* add_maestro(CLI::App& app, Settings& settings) {
  CLI::App* maestro = app.add_subcommand("maestro", "Pololu Maestro, device number 12");
  add_common(*maestro, settings.server);
  maestro
      ->add_option("--model", settings.maestro_model,
                   "A Mini Maestro with 24 channels, or the Micro Maestro: 6, and no Set Multiple Targets")
      ->check(CLI::IsMember({"micro", "mini"}))
      ->type_name("MODEL")
      ->capture_default_str();
  maestro->get_option("--baud")->check(CLI::Range(300, 200'000));
  maestro->add_flag("--crc", settings.maestro.crc, "Every command must end with a CRC-7");
  maestro->add_flag("!--ignore-errors", settings.maestro.errors_go_home,
                    "Set to 'Ignore' on error; else all servos go home, which is off");
  maestro->add_flag(
      "--detect-baud", settings.maestro.detects_baud,
      "Set to 'UART, detect baud rate': takes nothing before the byte AA, and a line at another speed "
      "carries garbage; else as over USB");
  maestro
      ->add_option("--timeout", settings.maestro.timeout_ms,
                   "'Timeout': without a valid command for so long it reports an error; 0: never")
      ->check(CLI::Range(0, 655'350))
      ->type_name("MS")
      ->capture_default_str();
  maestro->footer(kFooter);
  return maestro;
}

CLI::App* add_cia402(CLI::App& app, Settings& settings) {
  CLI::App* cia402 = app.add_subcommand("cia402", "Drives after CiA 402 on a CAN bus, node 1 and up");
  cia402->add_option("--can", settings.cia402.bus, "Interface, or unix:/PATH for a virtual bus")
      ->required()
      ->type_name("BUS");
  cia402->add_option("--nodes", settings.cia402.nodes, "How many drives; 0: a virtual bus without any")
      ->check(CLI::Range(0, 127))
      ->capture_default_str();
  cia402
      ->add_option("--position", settings.cia402.drive.position, "Where the shafts stand at first, in counts")
      ->capture_default_str();
  cia402
      ->add_option(
          "--record", settings.cia402.record,
          "Writes time_ns (of the monotonic clock), node, target and position in counts, and power (1: "
          "the motor has current), a row when one of a node's has changed")
      ->type_name("FILE.csv");
  cia402->footer(kCanFooter + explain_node_commands());
  return cia402;
}

/// Runs an emulated controller on a pseudo-terminal, until a signal requests the end.
void run_serial(Settings& settings, bool is_ssc32) {
  std::unique_ptr<SerialDevice> device;
  if (is_ssc32) {
    settings.ssc32.baud = settings.server.baud;
    device = std::make_unique<Ssc32Device>(settings.ssc32);
  } else {
    settings.maestro.baud = settings.server.baud;
    settings.server.checks_baud = settings.maestro.detects_baud;
    if (settings.maestro_model == "micro") {
      settings.maestro.channels = 6;
      settings.maestro.multi_target = false;
    }
    device = std::make_unique<MaestroDevice>(settings.maestro);
  }
  SimServer(std::move(device), settings.server).run();
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  CLI::App app{"Emulates a servo controller on a pseudo-terminal, or drives on a CAN bus", "corbot-sim"};
  app.set_version_flag("--version", CORBOT_VERSION);
  app.footer(kFooter);
  app.require_subcommand(1);

  const CLI::App* const ssc32 = add_ssc32(app, settings);
  add_maestro(app, settings);
  const CLI::App* const cia402 = add_cia402(app, settings);
  try {
    app.parse(argc, argv);
    if (settings.model == "ssc32") settings.ssc32.model = Ssc32Model::kSsc32;
    if (*ssc32) check_baud(settings.ssc32.model, settings.server.baud);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::Error& e) {
    const std::string unknown = unknown_device(app, argc > 1 ? argv[1] : "");
    const std::string fault = unknown.empty() ? e.what() : fmt::format("unknown device '{}'", unknown);
    fmt::print(stderr, "corbot-sim: {} (see 'corbot-sim --help')\n", fault);
    return kExitUsage;
  }

  try {
    if (*cia402) {
      Cia402Server(settings.cia402).run();
    } else {
      run_serial(settings, static_cast<bool>(*ssc32));
    }
  } catch (const std::exception& e) {
    fmt::print(stderr, "corbot-sim: {}\n", e.what());
    return kExitFailure;
  }
  return 0;
}
