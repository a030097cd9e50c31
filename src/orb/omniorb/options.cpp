// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/options.h"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace corbot::omni {

void parse_endpoint(const std::string& text, std::string& host, int& port) {
  const auto colon = text.rfind(':');
  const char* end = text.data() + text.size();
  const char* digits = colon == std::string::npos ? end : text.data() + colon + 1;
  const auto [rest, error] = std::from_chars(digits, end, port);
  if (colon == std::string::npos || colon == 0 || error != std::errc{} || rest != end || port < 1 ||
      port > 65535) {
    throw std::invalid_argument(fmt::format("'{}' is no HOST:PORT with a port from 1 to 65535", text));
  }
  host = text.substr(0, colon);
  if (host == "0.0.0.0" || host == "*") {
    throw std::invalid_argument(
        "name one host or address by which clients reach this machine, not all of them");
  }
}

int probe_port(const std::string& host, int port) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
      error != 0) {
    throw std::runtime_error(fmt::format("host {}: {}", host, ::gai_strerror(error)));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> guard(found, &::freeaddrinfo);
  const int fd = ::socket(found->ai_family, found->ai_socktype | SOCK_CLOEXEC, found->ai_protocol);
  const int on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  sockaddr_in bound{};
  socklen_t size = sizeof(bound);
  const bool ok = fd >= 0 && ::bind(fd, found->ai_addr, found->ai_addrlen) == 0 && ::listen(fd, 1) == 0 &&
                  ::getsockname(fd, reinterpret_cast<sockaddr*>(&bound), &size) == 0;
  const int error = errno;
  if (fd >= 0) ::close(fd);
  if (!ok) {
    throw std::runtime_error(fmt::format("cannot listen on {}:{}: {}{}", host, port, std::strerror(error),
                                         error == EADDRINUSE ? "; choose another port with --endpoint" : ""));
  }
  return ntohs(bound.sin_port);
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
  app.add_option("--endpoint", endpoint, "HOST:PORT to listen on, instead of the profile's");
  app.add_option("--unix", options.unix_path, "Unix socket to listen on as well");
  app.add_option("--naming", options.naming,
                 "naming service, for example corbaloc::127.0.0.1:2809/NameService");
  app.footer("Options that begin with -ORB go to omniORB.");
  try {
    std::vector<std::string> reversed(own.rbegin(), own.rend());  // as CLI11 takes them
    app.parse(reversed);
    if (!endpoint.empty()) parse_endpoint(endpoint, options.host, options.port);
  } catch (const CLI::ParseError& error) {
    std::exit(app.exit(error) == 0 ? 0 : 2);
  } catch (const std::invalid_argument& error) {
    fmt::print(stderr, "corbot-servant: --endpoint: {}\n", error.what());
    std::exit(2);
  }
  return options;
}

}  // namespace corbot::omni
