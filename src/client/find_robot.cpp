// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <vector>

#include "client/client.h"
#include "client/local_robots.h"
#include "client/number.h"
#include "config/profile.h"

namespace corbot::client {

namespace {

std::string how_to_start(const std::string& naming) {
  return fmt::format("start one with 'corbot up PROFILE', or name a robot elsewhere with {} HOST:PORT/NAME",
                     naming);
}

/// Returns HOST:PORT and NAME of "corbaloc::HOST:PORT/NAME", also with "iiop" and a GIOP version in it.
Address from_corbaloc(const std::string& uri) {
  Address address{uri, "", uri};
  const std::size_t slash = uri.find('/');
  const std::size_t host = uri.find(':', std::string("corbaloc:").size());
  if (slash == std::string::npos || host == std::string::npos || host > slash) return address;
  address.name = uri.substr(slash + 1);
  std::string where = uri.substr(host + 1, slash - host - 1);
  if (const std::size_t at = where.find('@'); at != std::string::npos) where.erase(0, at + 1);
  address.where = where;
  return address;
}

Failure no_such_robot(const std::string& name, const std::string& naming) {
  const std::string instead = robots_up_instead(name);
  return {ExitCode::kUnreachable,
          fmt::format("no robot named '{}' is up on this machine ({}){}", name, where_looked(name, naming),
                      instead.empty() ? fmt::format(": {}", how_to_start(naming)) : instead)};
}

Address from_state(const std::string& name, const std::string& naming) {
  const auto state = read_state(name);
  if (!is_up(name) || !state) throw no_such_robot(name, naming);
  if (state->address.empty()) {
    throw Failure(ExitCode::kUnreachable, fmt::format("'{}' is still starting: try again in a moment", name));
  }
  Address address = from_corbaloc(state->address);
  address.name = name;
  address.local = name;
  return address;
}

/// Adds the local robot to a given address. A robot of that name that is up here is another one, unless it
/// listens at this very address.
Address with_local(Address address) {
  try {
    const auto state = is_name(address.name) ? read_state(address.name) : std::nullopt;
    if (!state || !is_up(address.name)) return address;
    if (from_corbaloc(state->address).where == address.where) address.local = address.name;
  } catch (const Failure&) {
    // the state directory cannot be used: an address needs none
  }
  return address;
}

bool is_host_port_name(const std::string& text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) return false;
  const std::size_t colon = text.rfind(':', slash);
  return colon != std::string::npos && colon > 0 &&
         parse_integer(std::string_view(text).substr(colon + 1, slash - colon - 1)).has_value();
}

Address address_of(const std::string& robot, const std::string& naming) {
  std::string text = robot;
  if (text.empty()) {
    if (const char* given = std::getenv("CORBOT_ROBOT"); given != nullptr) text = given;
  }
  if (text.empty()) {
    const auto names = robots_up();
    if (names.size() == 1) return from_state(names[0], naming);
    if (names.empty()) {
      throw Failure(ExitCode::kUnreachable, fmt::format("no robot is up on this machine ({}): {}",
                                                        where_looked("", naming), how_to_start(naming)));
    }
    throw Failure(ExitCode::kUsage, fmt::format("{} robots are up: name one with {} {}", names.size(), naming,
                                                fmt::join(names, " | ")));
  }
  if (text.starts_with("corbaloc:")) return with_local(from_corbaloc(text));
  if (text.starts_with("corbaname:") || text.starts_with("IOR:")) {
    return {text, "", text.starts_with("IOR:") ? "the address in the IOR" : text};
  }
  if (is_host_port_name(text)) return with_local(from_corbaloc("corbaloc::" + text));
  if (is_name(text)) return from_state(text, naming);
  throw Failure(
      ExitCode::kUsage,
      fmt::format("{} '{}': write corbaloc::HOST:PORT/NAME, HOST:PORT/NAME ([IPV6]:PORT/NAME), an IOR, "
                  "or the name of a robot that is up here",
                  naming, printable(text)));
}

}  // namespace

Address find_robot(const std::string& robot, const std::string& naming) {
  Address address = address_of(robot, naming);
  address.naming = naming;
  return address;
}

}  // namespace corbot::client
