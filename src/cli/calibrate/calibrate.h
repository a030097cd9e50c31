// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace corbot::cli {

struct CalibrateOptions {
  std::string profile;
  std::string name;             ///< empty: the profile's
  std::string state_directory;  ///< directory of the last position; empty: the default one
  bool dry_run{false};          ///< `write` only shows the changes
};

/// Calibrates the servos of an arm that is not up, by commands on standard input, and writes the results into
/// its profile. Throws Failure.
void calibrate(const CalibrateOptions& options);

}  // namespace corbot::cli
