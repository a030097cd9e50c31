// SPDX-License-Identifier: Apache-2.0
#include "soak/kept.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

namespace corbot::soak {
namespace {

std::string rest_of(std::istringstream& words) {
  std::string rest;
  std::getline(words >> std::ws, rest);
  return rest;
}

void read_circumstance(std::istringstream& words, Kept& kept) {
  std::string kind;
  Interval when;
  words >> kind >> when.begin_ns >> when.end_ns;
  if (kind == "break") {
    int client = 0;
    words >> client;
    kept.breaks.push_back({when, rest_of(words), client});
  } else if (kind == "stall") {
    kept.stalls.push_back(when);
  } else if (kind == "clear") {
    bool done = false;
    words >> done;
    std::string cause = rest_of(words);
    std::replace(cause.begin(), cause.end(), '|', '\n');
    kept.clears.push_back({when, cause, done});
  } else if (kind == "restart") {
    double back_off_s = 0.0;
    words >> back_off_s;
    kept.restarts.push_back({when.begin_ns, back_off_s});
  }
}

}  // namespace

void write_circumstances(const Evidence& evidence, const WriteLine& write) {
  for (const Break& b : evidence.breaks)
    write(fmt::format("! break {} {} {} {}", b.begin_ns, b.end_ns, b.client, b.what));
  for (const Interval& stall : evidence.stalls)
    write(fmt::format("! stall {} {}", stall.begin_ns, stall.end_ns));
  for (const Clear& clear : evidence.clears) {
    std::string cause = clear.cause;
    std::replace(cause.begin(), cause.end(), '\n', '|');
    write(fmt::format("! clear {} {} {} {}", clear.begin_ns, clear.end_ns, clear.done ? 1 : 0, cause));
  }
  for (const Restart& restart : evidence.restarts)
    write(fmt::format("! restart {0} {0} {1}", restart.seen_ns, restart.back_off_s));
}

void Kept::read(std::istream& stream) {
  for (std::string line; std::getline(stream, line);) {
    const std::size_t space = std::min(line.find(' '), line.size());
    const std::string who = line.substr(0, space);
    const std::string text = line.substr(std::min(space + 1, line.size()));
    if (who == "!") {
      std::istringstream words(text);
      read_circumstance(words, *this);
    } else if (who == "0") {
      recording.read(text);
    } else if (who == "c") {
      ledger.read(kByCommand, text);
    } else if (who != "#") {
      ledger.read(static_cast<int>(std::strtol(who.c_str(), nullptr, 10)), text);
    }
  }
}

}  // namespace corbot::soak
