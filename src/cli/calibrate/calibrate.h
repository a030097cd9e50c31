// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

struct CalibrateOptions {
  std::string profile;
  std::string name;             ///< empty: the profile's
  std::string state_directory;  ///< of the last position; empty: the default one
  bool dry_run{false};          ///< `write` only shows what would change
};

/// Walks through the servos of an arm that is not up, by commands on standard input, and writes what was
/// found into its profile. Throws Failure.
void calibrate(const CalibrateOptions& options);

}  // namespace corbot::cli
