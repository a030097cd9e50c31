// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/options.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <stdexcept>

#include "net/endpoint.h"

namespace corbot::omni {

void check_port(const std::string& host, int port) {
  int bound = 0;
  char why[CORBOT_WHY] = "";
  const int fd = corbot_listen(host.c_str(), port, &bound, why);
  if (fd < 0) throw std::runtime_error(fmt::format("{}; --endpoint HOST:PORT chooses", why));
  ::close(fd);
}

Options parse_options(int argc, char** argv) {
  Options options;
  std::vector<std::string> own;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.rfind("-ORB", 0) == 0) {
      options.orb.push_back(word);
      if (i + 1 < argc) options.orb.emplace_back(argv[++i]);
    } else {
      own.push_back(word);
    }
  }
  CLI::App app{"corbot's servant on omniORB: serves a robot to CORBA clients", "corbot-servant"};
  std::string endpoint;
  app.add_option("PROFILE", options.profile, "profile of the robot, a TOML file")->required();
  app.add_option("--name", options.name, "name of the robot and object key, instead of the profile's");
  app.add_option("--endpoint", endpoint, "HOST:PORT or [IPV6]:PORT to listen on, instead of the profile's");
  app.add_option("--unix", options.unix_path, "Unix socket to listen on as well");
  app.add_option("--naming", options.naming,
                 "naming service, for example corbaloc::127.0.0.1:2809/NameService");
  app.add_option("--state-dir", options.state_directory,
                 "where the last position is saved, instead of $CORBOT_STATE_DIR or ~/.local/state/corbot");
  app.footer("Options that begin with -ORB go to omniORB.");
  try {
    std::vector<std::string> reversed(own.rbegin(), own.rend());  // the order that CLI11 expects
    app.parse(reversed);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error) == 0 ? 0 : 2);
  }
  if (endpoint.empty()) return options;
  corbot_endpoint parsed{};
  char why[CORBOT_WHY];
  if (!corbot_endpoint_parse(endpoint.c_str(), &parsed, why)) {
    fmt::print(stderr, "corbot-servant: --endpoint: {}\n", why);
    std::exit(2);
  }
  options.host = parsed.host;
  options.port = parsed.port;
  return options;
}

}  // namespace corbot::omni
