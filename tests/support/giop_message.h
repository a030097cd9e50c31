// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace corbot::test {

// Messages of any GIOP version and byte order, as they are on the wire.

/// Takes the first message out of `stream`; nothing if it is not whole yet. Returns bytes that begin no
/// message as they are.
std::optional<std::string> take_message(std::string& stream);

/// A Request that calls this operation.
bool is_request_of(const std::string& message, const std::string& operation);
bool is_reply(const std::string& message);
/// A Reply with LOCATION_FORWARD or LOCATION_FORWARD_PERM, or a LocateReply with OBJECT_FORWARD or
/// OBJECT_FORWARD_PERM.
bool is_forward(const std::string& message);

}  // namespace corbot::test
