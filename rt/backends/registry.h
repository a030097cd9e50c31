// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "config/profile.h"
#include "corbot/backend/backend.h"

namespace corbot::rt {

/// The backend that a profile names. Set-up only. Throws std::runtime_error for an unknown name, listing the
/// known.
[[nodiscard]] std::unique_ptr<Backend> make_backend(const Profile& profile);

}  // namespace corbot::rt
