// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cell.hh"
#include "client/explain.h"
#include "client/failure.h"

namespace corbot::cell {

/// Describes a store's refusal for a person.
[[nodiscard]] std::string refusal_text(const Corbot::BadParameter& error);
[[nodiscard]] std::string refusal_text(const Corbot::Full& error);
[[nodiscard]] std::string refusal_text(const Corbot::Occupied& error);

/// Returns f(), a call to one of a cell's programs. Throws a refusal as client::Failure, kRefused.
template <class F>
auto or_refusal(const std::string& program, F&& f) -> decltype(f()) {
  using client::ExitCode;
  using client::Failure;
  try {
    return f();
  } catch (const Corbot::NotReady& error) {
    throw Failure(ExitCode::kRefused, program + ": " + client::printable(error.reason.in()));
  } catch (const Corbot::BadParameter& error) {
    throw Failure(ExitCode::kRefused, refusal_text(error));
  } catch (const Corbot::Full& error) {
    throw Failure(ExitCode::kRefused, refusal_text(error));
  } catch (const Corbot::Occupied& error) {
    throw Failure(ExitCode::kRefused, refusal_text(error));
  }
}

}  // namespace corbot::cell
