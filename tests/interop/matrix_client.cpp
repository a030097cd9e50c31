// SPDX-License-Identifier: Apache-2.0
#include "interop/matrix_client.h"
#include "support/paths.h"

#include <signal.h>

#include <filesystem>

#include <fmt/core.h>
#include <gtest/gtest.h>

namespace corbot::test {

void PrintTo(const ClientKind& kind, std::ostream* out) { *out << kind.name; }

std::vector<ClientKind> client_kinds() {
  return {{"omniorb", CORBOT_TESTS_DIR "/client_omniorb", ""},
          {"orbit2", CORBOT_TESTS_DIR "/client_orbit2", ""},
          {"python", "", ""},
          {"java", "", ""},
          {"tcl", "", "error Combat cannot send"}};
}

std::string MatrixClient::prepare(const ClientKind& kind) {
  if (!kind.program.empty()) {
    program_ = kind.program;
    return std::filesystem::exists(program_) ? "" : "ORBit2 not found";
  }
  const std::string out = fmt::format("{}/{}", CORBOT_CLIENTS_OUT, kind.name);
  const RunResult made = run({fmt::format("{}/{}/prepare", CORBOT_CLIENTS_DIR, kind.name), out}, 500.0);
  program_ = out + "/client";
  if (made.code == 0) return "";
  if (made.code != 77) ADD_FAILURE() << "prepare: " << made.errors;
  return made.errors;
}

void MatrixClient::start(const std::string& scratch) {
  scratch_ = scratch;  // ORBit2 would make one under /tmp
  std::filesystem::create_directory(scratch_);
  std::filesystem::permissions(scratch_, std::filesystem::perms::owner_all);
  process_ = std::make_unique<Process>(std::vector<std::string>{program_},
                                       std::vector<std::string>{"ORBIT_SOCKETDIR=" + scratch_});
}

void MatrixClient::stop() {
  process_.reset();
  if (!scratch_.empty()) std::filesystem::remove_all(scratch_);
}

void MatrixClient::kill() {
  process_->signal(SIGKILL);
  process_->wait(within(10));
}

std::string MatrixClient::ask(const std::string& command) {
  process_->send(command);
  const auto answer = process_->wait_line("", within(60));
  return answer ? *answer : "no answer: " + process_->errors();
}

}  // namespace corbot::test
