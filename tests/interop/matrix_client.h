// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "support/process.h"

namespace corbot::test {

/// A client of the matrix, on an ORB of its own (tests/interop/clients).
struct ClientKind {
  std::string name;
  std::string program;  ///< built with the project; empty: made by clients/NAME/prepare
  /// How an answer begins that says what this client's ORB cannot do, whatever the servant. Empty: can all.
  std::string cannot;
};

void PrintTo(const ClientKind& kind, std::ostream* out);
/// All of them.
std::vector<ClientKind> client_kinds();

/// One of them, running.
class MatrixClient {
 public:
  /// Makes the program ready; the reason when that cannot be.
  std::string prepare(const ClientKind& kind);
  /// `scratch`: a directory of its own, which is removed in the end.
  void start(const std::string& scratch);
  void stop();
  /// As by kill -9.
  void kill();
  /// Sends a line and waits for the answer.
  std::string ask(const std::string& command);

  MatrixClient() = default;
  MatrixClient(const MatrixClient&) = delete;
  MatrixClient& operator=(const MatrixClient&) = delete;
  ~MatrixClient() { stop(); }

 private:
  std::string program_;
  std::string scratch_;
  std::unique_ptr<Process> process_;
};

}  // namespace corbot::test
