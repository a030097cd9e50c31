// SPDX-License-Identifier: Apache-2.0
#include "orbs/servers.h"
#include "support/paths.h"

#include <stdlib.h>
#include <sys/un.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace corbot::bench {

Scratch::Scratch() : path_(std::string(CORBOT_BINARY_DIR "/bench") + "/orbs-XXXXXX") {
  if (::mkdtemp(path_.data()) == nullptr) throw std::runtime_error("cannot make " + path_);
  ::setenv("TMPDIR", path_.c_str(), 1);
  ::setenv("ORBIT_SOCKETDIR", path_.c_str(), 1);  // or every ORBit2 program would leave one under /tmp
}

Scratch::~Scratch() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string Scratch::socket(const std::string& name) const {
  std::string path = path_ + "/" + name;
  if (path.size() >= sizeof(sockaddr_un{}.sun_path))
    throw std::runtime_error(path + " is too long for a socket");
  return path;
}

Placement::Placement() {
  if (::sched_getaffinity(0, sizeof(others_), &others_) != 0) throw std::runtime_error("sched_getaffinity");
  std::size_t cpu = CPU_SETSIZE - 1;
  while (!CPU_ISSET(cpu, &others_)) --cpu;
  CPU_SET(cpu, &one_);
  if (CPU_COUNT(&others_) > 1) CPU_CLR(cpu, &others_);
  on_the_one();
}

void Placement::on_the_one() const { (void)::sched_setaffinity(0, sizeof(one_), &one_); }

void Placement::on_the_others() const { (void)::sched_setaffinity(0, sizeof(others_), &others_); }

Servers::~Servers() {
  while (!running_.empty()) running_.pop_back();
}

std::string Servers::start(std::vector<std::string> command) {
  constexpr double kPatience_s = 30.0;
  const std::string word = "ready";
  test::Process& server = running_.emplace_back(command);
  const auto line = server.wait_line(word, test::within(kPatience_s));
  if (!line) throw std::runtime_error(command[0] + " does not start: " + server.errors());
  return line->substr(std::min(line->size(), word.size() + 1));
}

std::string Servers::start_robot(const std::string& program, const std::string& name,
                                 const std::vector<std::string>& address) {
  const std::string bin = CORBOT_BIN_DIR;
  placement_.on_the_others();
  start({bin + "/corbot-rt", CORBOT_TIMED_PROFILE, "--name", name});
  placement_.on_the_one();
  std::vector<std::string> command{bin + "/" + program, CORBOT_TIMED_PROFILE, "--name", name};
  command.insert(command.end(), address.begin(), address.end());
  return start(std::move(command));
}

}  // namespace corbot::bench
