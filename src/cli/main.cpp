// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cli/arm/kinematics.h"
#include "cli/calibrate/calibrate.h"
#include "cli/calibrate/calibrate_help.h"
#include "cli/calibrate/home.h"
#include "cli/cell/cell_commands.h"
#include "cli/commands.h"
#include "cli/conform/conform.h"
#include "cli/doctor/doctor.h"
#include "cli/plot/plot.h"
#include "cli/run_panel.h"
#include "cli/supervise/panel_port.h"
#include "cli/supervise/up.h"
#include "client/client.h"
#include "client/explain.h"
#include "client/help_formatter.h"
#include "client/number.h"
#include "client/number_within.h"
#include "config/similar.h"
#include "corbot/standard_streams.h"

namespace {

using namespace corbot::cli;
using namespace corbot::client;

/// All settings of the command line.
struct Settings {
  ClientOptions client;
  UpOptions up;
  std::string down_name;
  bool json{false};
  double interval_s{0.2};
  int count{0};
  std::string status_svg;         ///< file of the picture of `status`; empty: none
  std::vector<std::string> pose;  ///< argument of `solutions`
  PlanOptions plan;               ///< options of a motion
  RunOptions run;
  RecordOptions record;
  charts::PlotOptions plot;
  std::string doctor_profile;
  CalibrateOptions calibrate;
  HomeOptions home;
  bool is_agreed{false};  ///< the user agrees that `conform` moves the arm
  KinematicsOptions kinematics;
  ExportOptions exported;
  bool urdf{false};
};

/// Validates the file name of a picture. Standard output is not allowed, as the command's text goes there.
CLI::Validator picture_file() {
  return CLI::Validator(
      [](std::string& name) {
        return !name.ends_with(".svg") && !name.starts_with("/dev/")
                   ? fmt::format("'{}' is not the name of a file: write one that ends in .svg", name)
                   : std::string();
      },
      "");
}

void add_client_options(CLI::App& command, Settings& settings) {
  command
      .add_option("--robot", settings.client.robot,
                  "Name of a robot that is up here, HOST:PORT/NAME or [IPV6]:PORT/NAME, corbaloc or IOR\n"
                  "($CORBOT_ROBOT)")
      ->type_name("ROBOT");
  command
      .add_option("--timeout", settings.client.timeout_s, "Seconds that a call may take, not a motion (5)")
      ->check(number_within(0.1, 3600.0))
      ->type_name("SECONDS");
}

/// Shows the grammar of a verb; CLI11 would show "[values(0x)]".
class VerbFormatter : public HelpFormatter {
 public:
  explicit VerbFormatter(const VerbSpec& spec) : spec_(spec) {}
  std::string make_usage(const CLI::App*, std::string) const override {
    const char* dry_run = is_planned(spec_.verb) ? " [--dry-run [--profile P --plot FILE]]" : "";
    return fmt::format("Usage: corbot {}{} [--robot R] [--timeout S]\n", usage_of(spec_), dry_run);
  }
  std::string make_positionals(const CLI::App*) const override { return {}; }

 private:
  const VerbSpec& spec_;
};

/// Returns "; did you mean '--time'?" for the first unknown option in `words`, with or without its dashes.
/// Returns "; did you mean '--robot lynx5'?" for one other word, else "".
std::string similar_option(const CLI::App& command, const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  const std::vector<std::string_view> known(names.begin(), names.end());
  for (const std::string& word : words) {
    const std::string typed = (word.starts_with('-') ? "" : "--") + word.substr(0, word.find('='));
    const std::string_view near = corbot::most_similar(typed, known, corbot::kSimilarCommand);
    if (!near.empty()) return fmt::format("; did you mean '{}'?", near);
  }
  if (words.size() != 1 || words[0].starts_with('-')) return "";
  for (const char* option : {"--robot", "--name"}) {
    if (std::find(names.begin(), names.end(), option) != names.end())
      return fmt::format("; did you mean '{} {}'?", option, words[0]);
  }
  return "";
}

/// Returns the message for a wrong command line.
std::string explain_usage(const CLI::App* app, const CLI::Error& error) {
  std::string command = "corbot";
  const CLI::App* deepest = app;
  while (!deepest->get_subcommands().empty()) {
    deepest = deepest->get_subcommands().front();
    command += " " + deepest->get_name();
  }
  std::string what = error.what();
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    const std::vector<std::string> words = app->remaining(true);
    what = fmt::format("unexpected: {}{}", fmt::join(words, " "), similar_option(*deepest, words));
  } else if (!deepest->get_subcommands({}).empty()) {
    what = fmt::format("a command is missing: type one, such as '{} status{}'", command,
                       deepest == app ? "" : " CELL");
  }
  return fmt::format("{}: {} (see '{} --help')\n", command, printable(what), command);
}

/// Adds a sub-command for every verb. The parser for programs reads its arguments, too.
void add_verbs(CLI::App& app, Settings& settings,
               std::map<const VerbSpec*, std::vector<std::string>>& words) {
  for (const VerbSpec& spec : verbs()) {
    CLI::App* command = app.add_subcommand(std::string(spec.word), std::string(spec.help));
    command->formatter(std::make_shared<VerbFormatter>(spec));
    std::vector<std::string>& given = words[&spec];
    given.emplace_back(spec.word);
    if (!spec.arguments.empty()) {
      std::string names;
      for (const auto name : spec.arguments) names += (names.empty() ? "" : " ") + std::string(name);
      command
          ->add_option_function<std::vector<std::string>>(
              "values", [&given](const auto& v) { given.insert(given.end(), v.begin(), v.end()); }, names)
          ->type_name("")
          ->expected(0, 100);
    }
    for (const OptionSpec& option : spec.options) {
      const std::string name(option.name);
      if (option.value.empty()) {
        command->add_flag_callback(
            name, [&given, name] { given.push_back(name); }, std::string(option.help));
      } else {
        command
            ->add_option_function<std::string>(
                name,
                [&given, name](const auto& v) {
                  given.insert(given.end(), {name, v});
                },
                std::string(option.help))
            ->type_name(std::string(option.value));
      }
    }
    add_client_options(*command, settings);
    if (is_planned(spec.verb)) {
      auto* dry_run =
          command->add_flag("--dry-run", settings.plan.dry_run,
                            "Plan only: show the time, the limits that set it, and a near singularity");
      auto* profile =
          command->add_option("--profile", settings.plan.profile, "The robot's profile, for --plot");
      profile->type_name("FILE")->needs(dry_run);
      auto* plot = command->add_option("--plot", settings.plan.plot, "Draw the motion as it is planned");
      plot->type_name("FILE")->check(picture_file())->needs(profile);
      profile->needs(plot);
    }
    command->callback([&settings, &given] {
      const auto parsed = parse_request(given);
      if (const auto* fault = std::get_if<std::string>(&parsed)) {
        throw Failure(ExitCode::kUsage, given[0] + ": " + *fault);
      }
      const auto& request = std::get<Request>(parsed);
      settings.plan.dry_run ? show_plan(settings.client, request, settings.plan)
                            : run_request(settings.client, request);
    });
  }
}

void add_supervision(CLI::App& app, Settings& s) {
  CLI::App* up_command = app.add_subcommand("up", "Start a robot and supervise it, in the foreground");
  up_command->add_option("PROFILE", s.up.profile, "The robot's profile, a TOML file")
      ->required()
      ->type_name("");
  up_command->add_option("--name", s.up.name, "Name of the robot, instead of the profile's")
      ->type_name("NAME");
  up_command
      ->add_option("--endpoint", s.up.endpoint,
                   "HOST:PORT or [IPV6]:PORT to listen on, instead of the profile's")
      ->type_name("ADDRESS");
  up_command
      ->add_option(
          "--unix", s.up.unix_path,
          "Unix socket to listen on as well; each client process there has its own limit of waiting calls")
      ->type_name("PATH");
  auto* naming = up_command->add_option("--naming", s.up.naming_port,
                                        "Start a naming service, too, on this port of the loopback (2809)");
  naming->expected(0, 1)->check(whole_number_within(1, 65535))->type_name("PORT");
  add_panel_to(*up_command, s.up.panel_port);
  up_command->add_option("--orb", s.up.orb, "ORB of the servant (omniorb)")
      ->check(CLI::IsMember({"omniorb", "orbit2"}))
      ->type_name("ORB");
  up_command
      ->add_option("--realtime", s.up.realtime,
                   "Without real-time privileges: refuse to start, or go on without real time (best-effort)")
      ->check(CLI::IsMember({"enforce", "best-effort"}))
      ->type_name("MODE");
  up_command->add_flag("--simulated", s.up.simulated,
                       "Refuse a profile that drives a device: nothing real can move");
  up_command
      ->add_option("--state-dir", s.up.state_directory,
                   "Where the last position is kept ($CORBOT_STATE_DIR, $XDG_STATE_HOME/corbot, "
                   "~/.local/state/corbot)")
      ->type_name("DIRECTORY");
  up_command->add_flag(
      "--until-eof", s.up.until_eof,
      "End the robot at the end of standard input, such as a pipe from the program that starts it");
  up_command->add_flag("--replace", s.up.replace,
                       "First end a robot of that name that is up, whichever terminal started it");
  up_command->callback([&s, naming] {
    if (naming->count() > 0 && s.up.naming_port == 0) s.up.naming_port = 2809;
    up(s.up);
  });
  CLI::App* down_command = app.add_subcommand("down", "End a robot, or remove stale files after a crash");
  down_command->add_option("--name", s.down_name, "Name of the robot, if several are up")->type_name("NAME");
  down_command->callback([&s] { down(s.down_name, s.client.robot); });
  CLI::App* doctor_command =
      app.add_subcommand("doctor", "Examine the machine and a profile, and say what to fix");
  doctor_command
      ->add_option("PROFILE", s.doctor_profile,
                   "Profile, a TOML file: examine it, its port and its devices, too")
      ->type_name("");
  doctor_command->callback([&s] {
    if (!doctor(s.doctor_profile)) throw Failure(ExitCode::kRefused, "");
  });
}

void add_conform(CLI::App& app, Settings& s) {
  CLI::App* command = app.add_subcommand(
      "conform", "Check whether a robot of any make does what robot.idl says; this moves the arm");
  command->add_option("REFERENCE", s.client.robot, "The robot, as --robot takes it")
      ->required()
      ->type_name("");
  command->add_flag("--yes", s.is_agreed, "Move the arm without a question at the terminal");
  command->add_option("--timeout", s.client.timeout_s, "Seconds that a call may take, not a motion (5)")
      ->check(number_within(0.1, 3600.0))
      ->type_name("SECONDS");
  command->footer("Exit code 0: all that the pick-and-place cell needs holds; 1: something does not.");
  command->callback([&s] { conform(find_robot(s.client.robot), s.client.timeout_s, s.is_agreed); });
}

void add_calibration(CLI::App& app, Settings& s) {
  CLI::App* command =
      app.add_subcommand("calibrate", "Calibrate the servos and write the result into the profile");
  command->add_option("PROFILE", s.calibrate.profile, "The robot's profile, a TOML file")
      ->required()
      ->type_name("");
  command->add_option("--name", s.calibrate.name, "Name of the robot, instead of the profile's")
      ->type_name("NAME");
  command
      ->add_option("--state-dir", s.calibrate.state_directory,
                   "Where the last position is kept ($CORBOT_STATE_DIR, $XDG_STATE_HOME/corbot, "
                   "~/.local/state/corbot)")
      ->type_name("DIRECTORY");
  command->add_flag("--dry-run", s.calibrate.dry_run, "'write' shows what would change, and changes nothing");
  command->footer(std::string("The robot must not be up. Commands, from the terminal or a pipe:\n") +
                  calibrate_help());
  command->callback([&s] { calibrate(s.calibrate); });
  CLI::App* home_command =
      app.add_subcommand("home", "Home the drives of an arm that have no absolute encoders");
  home_command->add_option("PROFILE", s.home.profile, "The robot's profile, a TOML file")
      ->required()
      ->type_name("");
  home_command
      ->add_option("JOINT", s.home.joints,
                   "Names or numbers of joints, in the order of homing; none: all with a homing_method")
      ->type_name("");
  home_command->add_option("--name", s.home.name, "Name of the robot, instead of the profile's")
      ->type_name("NAME");
  home_command->footer(
      "The robot must not be up. The command shows what will move, and moves it when you type 'on'. Ctrl-C "
      "halts.");
  home_command->callback([&s] { home(s.home); });
}

void add_arm(CLI::App& app, Settings& s) {
  CLI::App* command = app.add_subcommand(
      "kinematics",
      "Show how corbot reads the geometry of an arm, its workspace, and its solutions at a pose");
  command->add_option("PROFILE", s.kinematics.profile, "The robot's profile, a TOML file")
      ->required()
      ->type_name("");
  auto* pose = command->add_option(
      "--pose", s.kinematics.pose,
      "Show the solutions at this pose of the tool: X,Y,Z in metres, or X,Y,Z,QW,QX,QY,QZ");
  pose->type_name("LIST");
  command
      ->add_option("--joints", s.kinematics.joints,
                   "Show the solutions at the pose of these joints: a number for each, degrees or m")
      ->type_name("LIST")
      ->excludes(pose);
  auto* svg = command->add_option("--svg", s.kinematics.svg, "Draw the arm and its reach into this file");
  svg->type_name("FILE")->check(picture_file());
  command->add_flag("--thumbnail", s.kinematics.thumbnail, "Draw the picture small, for a table")->needs(svg);
  command->add_flag("--json", s.kinematics.json, "Print JSON, for programs");
  command->callback([&s] { kinematics(s.kinematics); });
  CLI::App* export_command = app.add_subcommand("export", "Write the geometry of an arm for other programs");
  export_command->add_option("PROFILE", s.exported.profile, "The robot's profile, a TOML file")
      ->required()
      ->type_name("");
  export_command->add_flag("--urdf", s.urdf, "Write a URDF: links, joints, limits")->required();
  export_command->add_option("--output", s.exported.output, "File instead of standard output")
      ->type_name("FILE");
  export_command->callback([&s] { export_urdf(s.exported); });
}

void add_views(CLI::App& app, Settings& s) {
  const std::vector<std::tuple<const char*, const char*, View>> views{
      {"status", "Show state, joints, tool and gripper", View::kStatus},
      {"alarms", "Show the last alarms, oldest first", View::kAlarms},
      {"diagnostics", "Show cycles, latency and device of the real-time loop", View::kDiagnostics}};
  for (const auto& [name, help, view] : views) {
    CLI::App* command = app.add_subcommand(name, help);
    command->add_flag("--json", s.json, "Print JSON, for programs");
    if (view == View::kStatus) {
      command->add_option("--svg", s.status_svg, "Draw the arm as it stands, and its reach, into this file")
          ->type_name("FILE")
          ->check(picture_file());
    }
    add_client_options(*command, s);
    command->callback([&s, which = view] { show(s.client, which, s.json, s.status_svg); });
  }
  CLI::App* watch_command = app.add_subcommand("watch", "Show the status repeatedly");
  watch_command->add_option("--interval", s.interval_s, "Seconds between two outputs (0.2)")
      ->check(number_within(0.02, 3600.0))
      ->type_name("SECONDS");
  watch_command->add_option("--count", s.count, "End after so many outputs; 0: go on until Ctrl-C")
      ->check(whole_number_within(0, 1'000'000))
      ->type_name("NUMBER");
  add_client_options(*watch_command, s);
  watch_command->callback([&s] { run_watch(s.client, s.interval_s, s.count); });
}

void add_solutions(CLI::App& app, Settings& s) {
  CLI::App* command =
      app.add_subcommand("solutions", "Show all joint values at a pose of the tool, with their numbers");
  command
      ->add_option("POSE", s.pose,
                   "X Y Z in metres, with the present orientation of the tool, or X Y Z QW QX QY QZ")
      ->required()
      ->expected(3, 7)
      ->type_name("");
  command->add_flag("--json", s.json, "Print JSON, for programs");
  add_client_options(*command, s);
  command->callback([&s] {
    std::vector<double> pose;
    for (const std::string& word : s.pose) {
      const auto value = parse_number(word);
      if (!value) throw Failure(ExitCode::kUsage, "solutions: " + number_fault(word));
      pose.push_back(*value);
    }
    if (pose.size() != 3 && pose.size() != 7)
      throw Failure(ExitCode::kUsage, "solutions: write either X Y Z, or X Y Z QW QX QY QZ");
    show_solutions(s.client, pose, s.json);
  });
}

/// Adds a command that another program carries out, which is built only where there is Boost.
void add_panel(CLI::App& app, Settings& s) {
  CLI::App* command = app.add_subcommand(
      "panel", "Serve a web page to watch, stop and move robots: see 'corbot panel --help'");
  command->set_help_flag();
  command->prefix_command();
  command->callback([&s, command] {
    std::vector<std::string> words = command->remaining();
    if (!s.client.robot.empty()) words.push_back(s.client.robot);
    run_panel(words);
  });
}

void add_files(CLI::App& app, Settings& s) {
  CLI::App* run_command = app.add_subcommand("run", "Run a program: a text file with one command a line");
  run_command->add_option("PROGRAM", s.run.file, "File, - = standard input")->required()->type_name("");
  auto* dry_run = run_command->add_flag("--dry-run", s.run.dry_run,
                                        "Check the program and print its lines; nothing moves");
  auto* profile = run_command->add_option("--profile", s.run.profile,
                                          "With --dry-run: check the reach of this profile's arm, too");
  profile->type_name("FILE")->needs(dry_run);
  run_command->add_option("--plot", s.run.plot, "With --profile: draw the motions as they are planned")
      ->type_name("FILE")
      ->check(picture_file())
      ->needs(profile);
  add_client_options(*run_command, s);
  run_command->callback([&s] { run_file(s.client, s.run); });
  CLI::App* record_command = app.add_subcommand("record", "Record every cycle of the loop into a CSV file");
  record_command->add_option("FILE", s.record.file, "File, - = standard output")->required()->type_name("");
  record_command->add_option("--for", s.record.for_s, "End after so many seconds; otherwise at Ctrl-C")
      ->check(number_within(0.001, 1e6))
      ->type_name("SECONDS");
  record_command->add_flag("--force", s.record.force, "Overwrite an existing FILE");
  add_client_options(*record_command, s);
  record_command->callback([&s] { run_record(s.client, s.record); });
  CLI::App* plot_command = app.add_subcommand("plot", "Draw a file of 'record' as an SVG");
  plot_command->add_option("RECORD", s.plot.record, "A file of 'corbot record'")->required()->type_name("");
  plot_command
      ->add_option("-o,--output", s.plot.output, "File, - = standard output; otherwise RECORD with .svg")
      ->type_name("FILE");
  plot_command->callback([&s] { charts::plot(s.plot); });
}

/// Returns the words from the first that is no option of `app`, nor the value of one.
std::span<const std::string> without_options(const CLI::App& app, std::span<const std::string> words) {
  while (!words.empty()) {
    const std::size_t equal = words[0].find('=');
    const CLI::Option* option = app.get_option_no_throw(words[0].substr(0, equal));
    if (option == nullptr || !words[0].starts_with('-')) break;
    const bool has_value = equal == std::string::npos && option->get_items_expected_min() > 0;
    words = words.subspan(std::min<std::size_t>(words.size(), has_value ? 2 : 1));
  }
  return words;
}

/// Reports an unknown command: CLI11 only reports an argument too many or a sub-command too few. `parents`:
/// "", or "cell ".
void check_command(const CLI::App& app, std::span<const std::string> words, const std::string& parents = "") {
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  words = without_options(app, words);
  if (commands.empty() || words.empty() || words[0].starts_with('-')) return;
  std::vector<std::string> names;
  for (const CLI::App* command : commands) {
    if (command->get_name() == words[0])
      return check_command(*command, words.subspan(1), parents + words[0] + " ");
    names.push_back(command->get_name());
  }
  const std::vector<std::string_view> known(names.begin(), names.end());
  throw Failure(ExitCode::kUsage,
                fmt::format("unknown command '{}{}'{} ('corbot {}--help' lists them)", parents,
                            printable(words[0]), suggest_command(words[0], known), parents));
}

/// Refuses an empty word, and an option with an empty value. A shell passes these if a variable is not set,
/// and a default in their place could move another robot. A stop and a hold need no name: they end motions.
void check_no_word_is_empty(const CLI::App& app, const std::vector<std::string>& words) {
  const auto command = without_options(app, words);
  if (!command.empty() && (command[0] == "stop" || command[0] == "hold")) return;
  for (std::size_t i = 0; i < words.size() && words[i] != "--"; ++i) {
    const std::string& word = words[i];
    if (word.starts_with("--") && word.find('=') == word.size() - 1)
      throw Failure(ExitCode::kUsage,
                    fmt::format("'{}' has no value: is a variable of the shell not set?", printable(word)));
    if (!word.empty()) continue;
    const std::string& before = i > 0 ? words[i - 1] : "corbot";
    throw Failure(
        ExitCode::kUsage,
        fmt::format("an empty word follows '{}': is a variable of the shell not set?", printable(before)));
  }
}

/// Lets no option of `app` and its commands take another option as its value. In `--name $NAME --simulated`
/// the robot would be named --simulated if NAME is not set, and a device would be allowed.
void let_options_be_no_values(CLI::App& app) {
  const CLI::Validator validator(
      [](std::string& value) {
        return value.starts_with("--")
                   ? fmt::format("'{}' is an option: is a variable of the shell not set?", printable(value))
                   : std::string();
      },
      "");
  for (CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) option->check(validator);
  }
  for (CLI::App* command : app.get_subcommands({})) let_options_be_no_values(*command);
}

/// Divides `--robot=` into the option and an empty word: CLI11 would take the next word for its value.
std::vector<std::string> with_empty_values(std::vector<std::string> words) {
  for (std::size_t i = 0; i < words.size() && words[i] != "--"; ++i) {
    if (!words[i].starts_with("--") || words[i].find('=') != words[i].size() - 1) continue;
    words[i].pop_back();
    words.insert(words.begin() + static_cast<std::ptrdiff_t>(i) + 1, "");
  }
  return words;
}

int run(int argc, char** argv) {
  CLI::App app("corbot: a robot arm behind a CORBA interface, with a real-time body", "corbot");
  app.formatter(std::make_shared<HelpFormatter>());
  app.footer(
      "Exit codes: 0 done, 1 the robot refused or failed it, 2 wrong usage, 3 no such robot or no reply,\n"
      "4 stopped before its end, 5 an error of the machine.\n"
      "More: man corbot");
  app.require_subcommand(1);
  app.failure_message(explain_usage);
  app.set_version_flag("--version", "corbot " CORBOT_VERSION);
  Settings settings;
  std::map<const VerbSpec*, std::vector<std::string>> words;
  add_client_options(app, settings);
  // The order of the help, of packaging/man/corbot.1 and of docs/cli.md.
  add_supervision(app, settings);
  add_views(app, settings);
  add_solutions(app, settings);
  add_panel(app, settings);
  add_verbs(app, settings, words);
  add_files(app, settings);
  add_arm(app, settings);
  add_calibration(app, settings);
  add_conform(app, settings);
  add_cell(app);
  app.add_subcommand("version", "Print the version")->callback([] {
    fmt::print("corbot " CORBOT_VERSION "\n");
  });
  app.add_subcommand("help", "List the commands, or describe one, as in 'corbot help move'");
  std::vector<std::string> arguments = protect_negative_numbers(argc, argv);
  check_no_word_is_empty(app, arguments);
  arguments = with_empty_values(std::move(arguments));
  const auto help = arguments.begin() + (!arguments.empty() && arguments[0] == "cell" ? 1 : 0);
  if (help != arguments.end() && *help == "help") {  // the suggestion would be 'hold'
    arguments.erase(help);
    arguments.emplace_back("--help");
  }
  check_command(app, arguments);
  let_options_be_no_values(app);
  std::reverse(arguments.begin(), arguments.end());  // the order that CLI11 expects
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  }
  return static_cast<int>(ExitCode::kOk);
}

/// Checks that all output was written. Output may still be in the buffer. A reader that has closed its pipe
/// has read enough.
void check_printed() {
  errno = 0;
  const bool is_written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  pollfd reader{STDOUT_FILENO, POLLOUT, 0};
  if (is_written || errno == EPIPE || (::poll(&reader, 1, 0) == 1 && (reader.revents & POLLERR) != 0)) return;
  throw Failure(
      ExitCode::kInternal,
      fmt::format("standard output: {}", errno != 0 ? std::strerror(errno) : "not all could be written"));
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a limit of the file size then is an error of write, as a full disk is
  try {
    const int status = run(argc, argv);
    if (status == 0) check_printed();
    return status;
  } catch (const Failure& failure) {
    std::fflush(stdout);
    // Without fmt::print, which throws if standard error cannot be written.
    if (*failure.what() != '\0') std::fputs(fmt::format("corbot: {}\n", failure.what()).c_str(), stderr);
    return static_cast<int>(failure.code());
  } catch (const std::exception& error) {
    std::fputs(fmt::format("corbot: internal error: {}\n", error.what()).c_str(), stderr);
    return static_cast<int>(ExitCode::kInternal);
  }
}
