// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace corbot::client {

/// Writes all of `text`, or leaves a file of that name as it was: what is no plain file, such as a pipe, is written directly. Throws
/// Failure, kInternal.
void write_file(const std::string& file, std::string_view text);

}  // namespace corbot::client
