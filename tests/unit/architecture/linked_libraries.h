// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace corbot::test {

/// Names of the shared libraries that a program needs, by its dynamic section, theirs included (as the loader
/// finds them). Throws std::runtime_error if that cannot be found out.
[[nodiscard]] std::vector<std::string> linked_libraries(const std::filesystem::path& program);

/// Returns the libraries among them that belong to an ORB.
[[nodiscard]] std::vector<std::string> orbs_among(const std::vector<std::string>& libraries);

}  // namespace corbot::test
