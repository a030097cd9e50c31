// SPDX-License-Identifier: Apache-2.0
// corbot-panel serves a web page on which people watch, stop and move robots and cells. It is an
// ordinary client of them. It stops a robot on its machine by the stop segment, without the servant.
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "cell/running_cells.h"
#include "client/client.h"
#include "client/explain.h"
#include "client/failure.h"
#include "client/help_formatter.h"
#include "client/local_robots.h"
#include "client/notice.h"
#include "client/number_within.h"
#include "client/stop_on_signal.h"
#include "corbot/standard_streams.h"
#include "panel/cell_port.h"
#include "panel/corba_port.h"
#include "panel/server.h"
#include "panel/tokens.h"

namespace corbot::panel {
namespace {

namespace fs = std::filesystem;
using client::ExitCode;
using client::Failure;

/// Descriptors for the ORB, signals, files and one connection that the server is just accepting.
constexpr rlim_t kOwnDescriptors = 16;
/// Connections to one robot or cell, those of before its restart, and the segments for a Stop.
constexpr rlim_t kForEach = 12;
/// 'corbot up' kills a program that does not end within five seconds.
constexpr unsigned kEndsWithin_s = 4;

struct Options {
  std::vector<std::string> robots;
  std::vector<std::string> cells;
  ServerSettings server{};
  std::string token_file;
};

/// The robots and cells that the panel shows.
struct Shown {
  std::vector<std::string> robots;
  std::vector<cell::CellConfig> cells;
};

cell::CellConfig load(const std::string& word) {
  try {
    return cell::find_cell(word);
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  } catch (const Failure& failure) {
    throw Failure(failure.code(), fmt::format("--cell {}: {}", client::printable(word), failure.what()));
  }
}

template <class List>
void check_once(const char* what, const List& list) {
  for (auto one = list.begin(); one != list.end(); ++one) {
    if (std::find(list.begin(), one, *one) != one)
      throw Failure(ExitCode::kUsage, fmt::format("{} {}: is named twice", what, client::printable(*one)));
  }
}

std::vector<cell::CellConfig> cells_of(const Options& options) {
  std::vector<std::string> words = options.cells;
  if (words.empty() && options.robots.empty()) {
    for (const fs::path& directory : cell::running_cells()) words.push_back(directory.string());
  }
  std::vector<cell::CellConfig> cells;
  std::vector<std::string> names;
  for (const std::string& word : words) {
    cells.push_back(load(word));
    names.push_back(cells.back().name);
  }
  check_once("--cell", names);
  return cells;
}

/// The robots of a shown cell that run on this machine are shown, too.
Shown shown_by(const Options& options) {
  Shown shown{options.robots, cells_of(options)};
  if (options.robots.empty() && options.cells.empty()) shown.robots = client::robots_up();
  check_once("ROBOT", shown.robots);
  for (const cell::CellConfig& cell : shown.cells) {
    for (const cell::CellRobot& robot : cell.robots) {
      const std::string name = cell.robot_name(robot);
      if (!robot.profile.empty() && std::count(shown.robots.begin(), shown.robots.end(), name) == 0)
        shown.robots.push_back(name);
    }
  }
  if (shown.robots.empty() && shown.cells.empty())
    throw Failure(ExitCode::kUnreachable,
                  fmt::format("no robot is up on this machine ({}): start one with 'corbot up PROFILE', or "
                              "write HOST:PORT/NAME of a robot elsewhere; no cell runs, either",
                              client::where_looked("", kNaming)));
  return shown;
}

bool is_page(const fs::path& directory) {
  std::error_code ignored;
  return fs::is_regular_file(directory / "index.html", ignored);
}

/// Returns the directory of the page: `wanted`, the installed one, or the one that scripts/page has built.
fs::path page_directory(const fs::path& wanted) {
  if (!wanted.empty()) {
    if (is_page(wanted)) return wanted;
    throw Failure(ExitCode::kUsage, fmt::format("--pages {}: there is no index.html: name the directory that "
                                                "scripts/page has built",
                                                wanted.string()));
  }
  std::error_code ignored;
  const fs::path programs = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  for (const fs::path& directory :
       {programs.parent_path() / "share/corbot/page", programs.parent_path().parent_path() / "page"}) {
    if (is_page(directory)) return directory;
  }
  throw Failure(ExitCode::kUsage,
                "the page is not built: install npm and run scripts/page in the source tree, or name the "
                "directory of a built page with 'corbot panel --pages'");
}

std::string in_brackets(const std::string& host) {
  return host.find(':') == std::string::npos ? host : "[" + host + "]";
}

bool is_loopback(const std::string& host) { return host.starts_with("127.") || host == "::1"; }
bool is_any(const std::string& host) { return host == "0.0.0.0" || host == "::"; }

/// Warns of each ROBOT that no robot here has as its name. The panel shows it when it is up.
void warn(const std::vector<std::string>& robots) {
  for (const std::string& robot : robots) {
    try {
      (void)client::find_robot(robot, kNaming);
    } catch (const Failure& failure) {
      if (failure.code() == ExitCode::kUsage) throw;
      if (client::is_up(robot)) continue;  // it is starting
      client::notice(stderr, fmt::format("corbot-panel: warning: {}\n", failure.what()));
    }
  }
}

void warn(const ServerSettings& server) {
  if (is_loopback(server.host)) return;
  client::notice(stderr, fmt::format("corbot-panel: warning: {} is on the network, and the panel does not "
                                     "encrypt: a token can be read on the way\n",
                                     server.host));
  if (is_any(server.host) && server.more_hosts.empty())
    client::notice(stderr,
                   "corbot-panel: warning: browsers elsewhere are refused: name this machine, as they "
                   "write it, with --allow-host\n");
}

/// Prints the URLs, the part that is secret after '#', which a browser sends to no server.
void announce(const ServerSettings& server, int port, const Tokens& tokens) {
  const std::string host = !is_any(server.host)        ? in_brackets(server.host)
                           : server.more_hosts.empty() ? "127.0.0.1"
                                                       : server.more_hosts.front();
  client::notice(stdout,
                 fmt::format("watch and stop: http://{0}:{1}/#token={2}\n"
                             "drive as well:  http://{0}:{1}/#token={3}\n"
                             "panel ready; Ctrl-C ends it, and stops only a robot whose program it runs\n",
                             host, port, tokens.watch, tokens.drive));
}

/// Throws if the connections of browsers could use up the descriptors that calls to robots and cells need.
void reserve_descriptors(const ServerSettings& server, std::size_t watched) {
  const rlim_t needed = kOwnDescriptors + server.most_requests + server.most_sockets + kForEach * watched;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= needed) return;
  if (limit.rlim_max < needed)
    throw Failure(ExitCode::kUsage,
                  fmt::format("at most {} files may be open, and the panel needs {}: raise 'ulimit -n'",
                              limit.rlim_max, needed));
  limit.rlim_cur = needed;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

/// Ends the process soon, also if a robot or cell does not reply.
void end_soon() {
  std::signal(SIGALRM, [](int) {
    constexpr std::string_view kText =
        "corbot-panel: a robot or cell does not reply: if the panel ran a program on it, its Stop is not "
        "confirmed\n";
    (void)!::write(STDERR_FILENO, kText.data(), kText.size());
    ::_exit(static_cast<int>(ExitCode::kUnreachable));
  });
  ::alarm(kEndsWithin_s);
}

fs::path token_path(const Options& options, int port) {
  if (!options.token_file.empty()) return options.token_file;
  fs::path path = client::state_directory(true) / fmt::format("panel-{}.tokens", port);
  TokenFile::remove_stale(path);  // a panel that runs has this port at another address
  return path;
}

void serve(const Options& options) {
  const client::OnSignal signal({});  // before the ORB starts threads
  ServerSettings settings = options.server;
  settings.pages = page_directory(settings.pages);
  Shown shown = shown_by(options);
  const Tokens tokens = new_tokens();
  settings.watch_token = tokens.watch;
  settings.drive_token = tokens.drive;
  if (!is_any(settings.host)) settings.more_hosts.push_back(in_brackets(settings.host));
  reserve_descriptors(settings, shown.robots.size() + shown.cells.size());
  const CORBA::ORB_var orb = start_panel_orb();
  std::vector<std::unique_ptr<Watch>> watches;
  for (const std::string& name : shown.robots)
    watches.push_back(std::make_unique<Watch>(name, std::make_unique<CorbaPort>(orb.in(), name)));
  for (cell::CellConfig& cell : shown.cells) {
    const std::string name = cell.name;
    watches.push_back(
        std::make_unique<Watch>(name, std::make_unique<CellPort>(orb.in(), std::move(cell)), Watched::kCell));
  }
  Server server(settings, std::move(watches));
  const TokenFile file(token_path(options, server.port()), tokens);
  warn(options.server);
  warn(options.robots);
  std::thread serving([&] { server.run(); });
  announce(options.server, server.port(), tokens);
  while (!signal.wait(3600)) {
  }
  end_soon();
  server.end();
  serving.join();
}

/// Validates a name that is compared with those in requests.
std::string host_fault(const std::string& name) {
  const bool is_address = name.starts_with('[') && name.ends_with(']');
  const bool is_name = !name.empty() && name.find_first_of(":/ ") == std::string::npos;
  if (is_address || is_name) return {};
  return fmt::format("'{}' is no name: write it without scheme and port, such as bench.local",
                     client::printable(name));
}

int run(int argc, char** argv) {
  CLI::App app("Serves a web page on which people watch, stop and move robots", "corbot-panel");
  app.formatter(std::make_shared<client::HelpFormatter>());
  Options options;
  options.server.port = 8080;
  app.add_option(
         "ROBOT", options.robots,
         "Names of robots that are up here, or HOST:PORT/NAME; neither ROBOT nor --cell: all that are "
         "up here")
      ->type_name("");
  app.add_option(
         "--cell", options.cells,
         "Cell to show: its name or state directory if it runs here, or its TOML file; can be repeated")
      ->type_name("CELL")
      ->allow_extra_args(false);  // a ROBOT may follow
  app.add_option("--port", options.server.port, "Port to listen on (8080); 0: any free one")
      ->check(client::whole_number_within(0, 65535))
      ->type_name("PORT");
  app.add_option("--host", options.server.host, "Address to listen on, in figures (127.0.0.1); 0.0.0.0: all")
      ->type_name("ADDRESS");
  app.add_option("--allow-host", options.server.more_hosts,
                 "Name of this machine that browsers elsewhere use; can be repeated")
      ->type_name("NAME")
      ->check(host_fault, "")
      ->allow_extra_args(false);  // a ROBOT may follow
  app.add_option("--pages", options.server.pages, "Directory of the built page, instead of the installed one")
      ->type_name("DIR");
  app.add_option("--token-file", options.token_file,
                 "New file for the tokens, instead of panel-PORT.tokens in the runtime directory")
      ->type_name("FILE");
  app.set_version_flag("--version", "corbot-panel " CORBOT_VERSION);
  app.footer(
      "Prints two URLs with a token each: one to watch and stop, one to drive as well.\n"
      "More: man corbot-panel");
  app.failure_message([](const CLI::App*, const CLI::Error& error) {
    return fmt::format("corbot-panel: {} (see 'corbot-panel --help')\n", client::printable(error.what()));
  });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
  }
  serve(options);
  return 0;
}

}  // namespace
}  // namespace corbot::panel

int main(int argc, char** argv) {
  using namespace corbot;
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return panel::run(argc, argv);
  } catch (const client::Failure& failure) {
    client::notice(stderr, fmt::format("corbot-panel: {}\n", failure.what()));
    return static_cast<int>(failure.code());
  } catch (const std::exception& error) {
    client::notice(stderr, fmt::format("corbot-panel: internal error: {}\n", error.what()));
    return static_cast<int>(client::ExitCode::kInternal);
  }
}
