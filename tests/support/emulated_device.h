// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "support/device_record.h"
#include "support/process.h"

namespace corbot::test {

/// corbot-sim, with a record of what its servos or drives were given.
class EmulatedDevice {
 public:
  /// The whole command but for --record.
  EmulatedDevice(std::vector<std::string> command, std::string record)
      : command_(std::move(command)), record_(std::move(record)) {
    command_.insert(command_.end(), {"--record", record_});
  }

  [[nodiscard]] const std::string& record() const { return record_; }
  /// Its rows so far.
  [[nodiscard]] std::vector<DeviceRow> rows() const { return device_rows(record_); }
  void start() {
    process_ = std::make_unique<Process>(command_);
    ASSERT_TRUE(process_->wait_line("ready", within(30))) << process_->errors();
  }
  /// Its exit code; 0 where it was not started.
  int stop() {
    const int code = process_ ? process_->terminate() : 0;
    process_.reset();
    return code;
  }
  /// Sends a signal to the program. Returns from SIGSTOP when its threads stand.
  void signal(int number) { process_->signal(number); }
  /// Sends a command and waits until it is done.
  void command(const std::string& text) {
    process_->send(text);
    EXPECT_EQ(process_->wait_line("ok", within(30)).value_or("no answer"), "ok " + text)
        << process_->errors();
  }
  /// Returns the device's reply to a question: the rest of the line after `question`; empty: nothing.
  [[nodiscard]] std::string answer(const std::string& question) {
    process_->send(question);
    const auto line = process_->wait_line(question, within(30));
    return line ? line->substr(question.size()) : "";
  }
  /// A question's values by channel, or by node: "pulses", "positions", "targets".
  [[nodiscard]] std::map<int, double> values(const std::string& question) {
    std::map<int, double> found;
    std::istringstream words(answer(question));
    for (std::string word; words >> word;) {
      const std::size_t equal = word.find('=');
      found[std::stoi(word.substr(0, equal))] = std::stod(word.substr(equal + 1));
    }
    return found;
  }
  /// All that it has printed.
  [[nodiscard]] std::string output() const { return process_->output(); }

 protected:
  [[nodiscard]] pid_t pid() const { return process_->pid(); }

 private:
  std::vector<std::string> command_;
  std::string record_;
  std::unique_ptr<Process> process_;
};

}  // namespace corbot::test
