// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace corbot::client {

/// Writes all of `text`, or leaves an existing file unchanged. A file that is not regular, such as a pipe, is
/// written directly. Throws Failure, kInternal.
void write_file(const std::string& file, std::string_view text);

}  // namespace corbot::client
