// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client/client.h"

namespace corbot::panel {

/// Carries out a program's statements on one robot, as a client of its own.
class Performer {
 public:
  Performer() = default;
  Performer(const Performer&) = delete;
  Performer& operator=(const Performer&) = delete;
  virtual ~Performer() = default;

  /// Executes a request and returns when it is done; see client::Client::perform().
  [[nodiscard]] virtual std::string perform(const client::Request& request,
                                            const client::ProgressReport& report) = 0;
  /// Prevents perform() from starting any motion from now on. Another thread calls it before it stops the
  /// arm.
  virtual void begin_cancel() noexcept = 0;
};

}  // namespace corbot::panel
