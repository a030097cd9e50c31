// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "support/process.h"

namespace corbot::test {

/// corbot-sim cia402 on a bus of its own; on the interface that CORBOT_RIG_CAN names where that is set, and
/// then no other test may run on it.
class EmulatedDrives {
 public:
  /// `directory` exists; the bus's socket and the record are made in it.
  EmulatedDrives(std::string program, std::string directory, int nodes, std::vector<std::string> more = {})
      : program_(std::move(program)),
        directory_(std::move(directory)),
        nodes_(nodes),
        more_(std::move(more)) {
    const char* interface = std::getenv("CORBOT_RIG_CAN");
    bus_ = interface != nullptr ? interface : "unix:" + directory_ + "/can";
  }

  /// The name of the bus, as a profile has it.
  [[nodiscard]] const std::string& bus() const { return bus_; }
  [[nodiscard]] std::string record() const { return directory_ + "/counts.csv"; }

  void start() {
    std::vector<std::string> command{program_,   "cia402", "--can", bus_, "--nodes", std::to_string(nodes_),
                                     "--record", record()};
    command.insert(command.end(), more_.begin(), more_.end());
    process_ = std::make_unique<Process>(command);
    ASSERT_TRUE(process_->wait_line("ready", within(30))) << process_->errors();
  }
  int stop() {
    const int code = process_ ? process_->terminate() : 0;
    process_.reset();
    return code;
  }
  /// Sends a command and waits until it is done.
  void command(const std::string& text) {
    process_->send(text);
    EXPECT_EQ(process_->wait_line("ok", within(30)).value_or("no answer"), "ok " + text);
  }
  /// By node: "positions", or "targets".
  std::map<int, std::int32_t> counts(const std::string& what = "positions") {
    process_->send(what);
    const auto line = process_->wait_line(what, within(10));
    std::map<int, std::int32_t> found;
    if (!line) return found;
    std::istringstream words(line->substr(what.size()));
    for (std::string word; words >> word;) {
      const std::size_t equal = word.find('=');
      found[std::stoi(word.substr(0, equal))] = std::stoi(word.substr(equal + 1));
    }
    return found;
  }
  /// The largest step between two targets that any node was ever given one after the other, and of any
  /// shaft. The first row of a node counts from `begin`.
  std::pair<std::int64_t, std::int64_t> largest_steps(std::int64_t begin = 0) const {
    std::ifstream file(record());
    std::string line;
    std::getline(file, line);
    std::map<int, std::pair<std::int64_t, std::int64_t>> last;
    std::pair<std::int64_t, std::int64_t> largest{0, 0};
    while (std::getline(file, line)) {
      std::replace(line.begin(), line.end(), ',', ' ');
      std::istringstream words(line);
      std::int64_t time_ns = 0;
      int node = 0;
      std::int64_t target = 0;
      std::int64_t position = 0;
      if (!(words >> time_ns >> node >> target >> position)) continue;
      const auto [at, is_new] = last.try_emplace(node, begin, begin);
      largest.first = std::max(largest.first, std::abs(target - at->second.first));
      largest.second = std::max(largest.second, std::abs(position - at->second.second));
      at->second = {target, position};
    }
    return largest;
  }

 private:
  std::string program_;
  std::string directory_;
  int nodes_;
  std::vector<std::string> more_;
  std::string bus_;
  std::unique_ptr<Process> process_;
};

}  // namespace corbot::test
