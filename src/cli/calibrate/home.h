// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace corbot::cli {

struct HomeOptions {
  std::string profile;
  std::vector<std::string> joints;  ///< names, or numbers from 1; none: all that have a homing_method
  std::string name;                 ///< empty: the profile's
};

/// Homes the drives of an arm that is not up, one after the other, when a person has typed 'on'. Throws
/// Failure.
void home(const HomeOptions& options);

}  // namespace corbot::cli
