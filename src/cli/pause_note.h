// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "client/client.h"
#include "client/failure.h"

namespace corbot::cli {

/// Finds out why an accepted motion does not begin.
class PauseNote {
 public:
  /// `client` must outlive it.
  explicit PauseNote(client::Client& client) : client_(client) {}

  /// Called with each report of progress. Returns a text once if the arm is paused, else "".
  [[nodiscard]] std::string operator()(double progress) {
    if (is_said_ || progress > 0.0) return "";
    try {
      is_said_ = client_.call([](auto& arm) { return arm.Paused(); });
    } catch (const client::Failure&) {  // the wait for the motion reports it
    }
    return is_said_ ? "the arm is paused; its motions wait until 'corbot resume'" : "";
  }

 private:
  client::Client& client_;
  bool is_said_{false};
};

}  // namespace corbot::cli
