// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::omni {

/// Limits the ORB's own lines on standard error to 100 a minute. Without a limit, each wrong message of any
/// client adds lines, and a flood fills the disk that has the log. The next line that is written tells how
/// many were left out. Call this before the ORB starts.
void limit_orb_log();

}  // namespace corbot::omni
