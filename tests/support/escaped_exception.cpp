// SPDX-License-Identifier: Apache-2.0
#include "support/escaped_exception.h"

#include <gtest/gtest.h>

#include <cell.hh>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <robot.hh>

#include <fmt/core.h>

namespace corbot::test {
namespace {

std::string field(const char* text) { return fmt::format("\"{}\"", text); }
std::string field(const Corbot::Point& point) {
  return fmt::format("({}, {}, {})", point.x, point.y, point.z);
}
std::string field(Corbot::TransferStep step) {
  static const char* const kSteps[] = {"StepReserved", "StepPicking",   "StepHeld",    "StepPlacing",
                                       "StepPlaced",   "StepWithdrawn", "StepUnclear", "StepGone"};
  const auto index = static_cast<std::size_t>(step);
  return index < std::size(kSteps) ? kSteps[index] : fmt::format("{}", index);
}
template <class Number>
std::string field(Number number) {
  return fmt::format("{}", number);
}

/// Names and values of fields in turn.
template <class Value, class... More>
std::string in_words(const char* name, const Value& value, const More&... more) {
  std::string text = fmt::format("{} = {}", name, field(value));
  if constexpr (sizeof...(more) > 0) text += ", " + in_words(more...);
  return text;
}

/// The fields of an exception of robot.idl; arm.idl adds no exception.
std::optional<std::string> robot_fields(const CORBA::Exception& exception) {
  if (const auto* e = Corbot::BadParameter::_downcast(&exception)) {
    return in_words("parameter", e->parameter.in(), "value", e->value, "reason", e->reason.in());
  }
  if (const auto* e = Corbot::Unreachable::_downcast(&exception)) {
    return in_words("target", e->target, "reason", e->reason.in());
  }
  if (const auto* e = Corbot::LimitExceeded::_downcast(&exception)) {
    return in_words("quantity", e->quantity.in(), "articulation", e->articulation, "value", e->value, "lower",
                    e->lower, "upper", e->upper);
  }
  if (const auto* e = Corbot::NotReady::_downcast(&exception)) return in_words("reason", e->reason.in());
  if (const auto* e = Corbot::Stopped::_downcast(&exception)) return in_words("reason", e->reason.in());
  if (const auto* e = Corbot::QueueFull::_downcast(&exception)) return in_words("capacity", e->capacity);
  return std::nullopt;
}

/// The fields of an exception of cell.idl.
std::optional<std::string> cell_fields(const CORBA::Exception& exception) {
  if (const auto* e = Corbot::Claimed::_downcast(&exception)) {
    return in_words("robot", e->robot.in(), "who", e->who.in(), "token", e->token, "since", e->since);
  }
  if (const auto* e = Corbot::Superseded::_downcast(&exception)) {
    return in_words("token", e->token, "present", e->present);
  }
  if (const auto* e = Corbot::WrongStep::_downcast(&exception)) {
    return in_words("present", e->present, "wanted", e->wanted);
  }
  if (const auto* e = Corbot::Empty::_downcast(&exception)) return in_words("place", e->place.in());
  if (const auto* e = Corbot::Full::_downcast(&exception)) {
    return in_words("place", e->place.in(), "capacity", e->capacity);
  }
  if (const auto* e = Corbot::Occupied::_downcast(&exception)) {
    return in_words("place", e->place.in(), "robot", e->robot.in(), "since", e->since);
  }
  return std::nullopt;
}

std::string system_fields(const CORBA::SystemException& exception) {
  const char* words = exception.NP_minorString();
  std::string minor = fmt::format("{:#x}", exception.minor());
  if (words != nullptr && *words != '\0') minor = fmt::format("{} ({})", words, minor);
  static const char* const kCompletion[] = {"COMPLETED_YES", "COMPLETED_NO", "COMPLETED_MAYBE"};
  return fmt::format("minor = {}, completed = {}", minor, kCompletion[exception.completed()]);
}

/// Prints the exception that is being handled, if it is one of CORBA.
void print_current() {
  if (std::current_exception() == nullptr) return;
  try {
    throw;
  } catch (const CORBA::Exception& exception) {
    std::printf("The exception is CORBA's %s\n", described(exception).c_str());
    std::fflush(stdout);
  } catch (...) {  // NOLINT(bugprone-empty-catch): nothing is known of it
  }
}

/// GoogleTest knows std::exception alone. It reports what else escapes a test in the handler that caught it,
/// so the exception is still the current one here.
class EscapePrinter : public ::testing::EmptyTestEventListener {
  void OnTestPartResult(const ::testing::TestPartResult& result) override {
    if (std::string(result.message()).starts_with("Unknown C++ exception")) print_current();
  }
};

std::terminate_handler default_terminate = nullptr;

/// The end of a program of which an exception escaped a thread.
[[noreturn]] void print_and_terminate() {
  print_current();
  default_terminate();
  std::abort();
}

}  // namespace

std::string described(const CORBA::Exception& exception) {
  std::optional<std::string> fields = robot_fields(exception);
  if (!fields) fields = cell_fields(exception);
  if (const auto* system = CORBA::SystemException::_downcast(&exception)) fields = system_fields(*system);
  return fmt::format("{} {{{}}}", exception._name(), fields.value_or(exception._rep_id()));
}

}  // namespace corbot::test

// The linker takes this file out of the library for its symbol, which tests/support/CMakeLists.txt names.
extern "C" const bool corbot_prints_escapes;
extern "C" const bool corbot_prints_escapes = [] {
  ::testing::UnitTest::GetInstance()->listeners().Append(new corbot::test::EscapePrinter);
  corbot::test::default_terminate = std::set_terminate(corbot::test::print_and_terminate);
  return true;
}();
