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
#include <utility>

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

namespace {

/// A listening socket, for as long as it takes to know its port.
class Probe {
 public:
  Probe(const std::string& host, int port) {
    addrinfo hints{};
    hints.ai_family = AF_INET;
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (const int error = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
        error != 0) {
      throw std::runtime_error(fmt::format("host {}: {}", host, ::gai_strerror(error)));
    }
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> guard(found, &::freeaddrinfo);
    fd_ = ::socket(found->ai_family, found->ai_socktype | SOCK_CLOEXEC, found->ai_protocol);
    const int on = 1;
    ::setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    sockaddr_in bound{};
    socklen_t size = sizeof(bound);
    if (fd_ >= 0 && ::bind(fd_, found->ai_addr, found->ai_addrlen) == 0 && ::listen(fd_, 1) == 0 &&
        ::getsockname(fd_, reinterpret_cast<sockaddr*>(&bound), &size) == 0) {
      port_ = ntohs(bound.sin_port);
      return;
    }
    const int error = errno;
    if (fd_ >= 0) ::close(fd_);
    throw std::runtime_error(fmt::format("cannot listen on {}:{}: {}{}", host, port, std::strerror(error),
                                         error == EADDRINUSE ? "; choose another port with --endpoint" : ""));
  }
  Probe(Probe&& other) noexcept : fd_(std::exchange(other.fd_, -1)), port_(other.port_) {}
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;
  Probe& operator=(Probe&&) = delete;
  ~Probe() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int port() const noexcept { return port_; }

 private:
  int fd_ = -1;
  int port_ = 0;
};

}  // namespace

std::vector<int> find_ports(const std::string& host, int port, std::size_t more) {
  std::vector<Probe> probes;  // all open at once, so that no port is found twice
  probes.emplace_back(host, port);
  for (std::size_t i = 0; i < more; ++i) probes.emplace_back(host, 0);
  std::vector<int> ports;
  for (const Probe& probe : probes) ports.push_back(probe.port());
  return ports;
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
