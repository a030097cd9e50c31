// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "panel/order.h"

namespace corbot::panel {

/// Returns the request in the body of POST /api/call, such as {"robot": NAME, "do": "move", "to_m": [X, Y,
/// Z]}. It does not check the robot's name. Throws client::Failure, kUsage: the body has another form, or a
/// value that no robot could take.
[[nodiscard]] client::Request call_request(const nlohmann::json& body);

/// Does the same for {"cell": NAME, "do": ACTION, …}. It does not check whether the cell has the place.
[[nodiscard]] CellRequest cell_request(const nlohmann::json& body);

}  // namespace corbot::panel
