// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/remote_call.h"

#include <fmt/format.h>

namespace corbot::cell {

bool may_recover(const CORBA::SystemException& e) {
  return CORBA::TRANSIENT::_downcast(&e) != nullptr || CORBA::COMM_FAILURE::_downcast(&e) != nullptr ||
         CORBA::TIMEOUT::_downcast(&e) != nullptr;
}

client::Failure explain_call(const CORBA::SystemException& e, const std::string& uri) {
  if (!may_recover(e)) return client::explain(e, {uri, uri, uri});
  return {client::ExitCode::kUnreachable,
          fmt::format("no reply from {} ({})", uri, client::is_call_timeout(e) ? "timed out" : e._name())};
}

}  // namespace corbot::cell
