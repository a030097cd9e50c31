// SPDX-License-Identifier: Apache-2.0
#include "client/explain.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <netdb.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <vector>

#include "client/local_robots.h"
#include "config/similar.h"
#include "corbot/interface_words.h"
#include "net/places.h"

namespace corbot::client {

namespace {

/// A longer distance than any arm here reaches was probably meant in centimetres or millimetres.
constexpr double kUnlikely_m = 5.0;

/// Returns the unit with a blank in front, or "" if it is not known.
std::string unit_of(std::string_view quantity, const std::optional<Corbot::JointInfo>& joint) {
  if (quantity == kDurationWord) return " s";
  if (!joint) return "";
  const std::string unit = joint->kind == Corbot::JointSlides ? " m" : " degrees";
  return quantity == kSpeedWord ? unit + " a second" : unit;
}

/// Returns " (180 at 100 %: …)" for a speed limit that is lower than the joint's own; else "".
std::string lowered_speed(const Corbot::LimitExceeded& e, const std::optional<Corbot::JointInfo>& joint) {
  const double percent = joint && joint->speed > 0.0 ? 100.0 * e.upper / joint->speed : 100.0;
  if (std::string_view(e.quantity.in()) != kSpeedWord || !(percent < 99.999)) return "";
  return fmt::format(" ({} at 100 %, the speed in force is {:.3g} %: 'corbot speed')", plain(joint->speed),
                     percent);
}

/// Returns a clause if the limits of a joint's range are narrower than its own; else "".
std::string soft_limits(const Corbot::LimitExceeded& e, const std::optional<Corbot::JointInfo>& joint) {
  constexpr double kSame = 1e-6;  // degrees or m
  if (!joint || std::string_view(e.quantity.in()) != kJointRangeWord) return "";
  const auto& [lower, upper] = joint->range;
  if (e.lower <= lower + kSame && e.upper >= upper - kSame) return "";
  return fmt::format("; these are soft limits, the joint's range is {} to {} ('corbot limit' sets them)",
                     plain(lower), plain(upper));
}

/// Returns true if `text` contains `word` without a letter or digit next to it.
bool names(std::string_view text, std::string_view word) {
  const auto is_of_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  for (std::size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !is_of_word(text[at - 1])) && (end == text.size() || !is_of_word(text[end]))) return true;
  }
  return false;
}

std::string without_full_stop(std::string text) {
  while (!text.empty() && (text.back() == '.' || text.back() == ' ')) text.pop_back();
  return text;
}

/// Returns the host of "HOST:PORT" if it cannot be resolved. Returns "" if it can, or `where` has another
/// form.
std::string unresolved_host(const std::string& where) {
  const std::size_t colon = where.rfind(':');
  if (colon == std::string::npos || where.starts_with('[')) return "";
  std::string host = where.substr(0, colon);
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, nullptr, &found) != 0) return host;
  ::freeaddrinfo(found);
  return "";
}

}  // namespace

std::string plain(double value) {
  if (std::isfinite(value) && std::abs(value) < 1e-9) value = 0;  // also -0
  return fmt::format("{:.6g}", value);
}

bool has_default_pitch(Corbot::RobotKind kind, std::size_t joints) {
  return kind == Corbot::Anthropomorphic && joints == 4;
}

bool has_offset(const Corbot::Pose& frame) {
  constexpr double kNone_m = 1e-9;
  const Corbot::Point& p = frame.position;
  return std::abs(p.x) + std::abs(p.y) + std::abs(p.z) > kNone_m;
}

bool is_turned(const Corbot::Pose& frame) {
  constexpr double kNone = 1e-9;
  const Corbot::Quaternion& q = frame.orientation;
  return std::abs(q.x) + std::abs(q.y) + std::abs(q.z) > kNone;
}

const char* metres_hint(double x_m, double y_m, double z_m) {
  const double farthest_m = std::max({std::abs(x_m), std::abs(y_m), std::abs(z_m)});
  return farthest_m >= kUnlikely_m ? "; numbers are metres: 20 cm is 0.20" : "";
}

int number_of_joint(std::span<const std::string> names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::string_view near = most_similar(name, known, kSimilarKey);
  throw Failure(ExitCode::kUsage,
                fmt::format("JOINT '{}': the arm has no such joint; its joints are {} (0 to {}){}",
                            printable(name), fmt::join(names, ", "), static_cast<int>(names.size()) - 1,
                            near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
}

bool is_call_timeout(const CORBA::SystemException& e) {
  return CORBA::TIMEOUT::_downcast(&e) != nullptr ||
         (CORBA::TRANSIENT::_downcast(&e) != nullptr && e.minor() == omni::TRANSIENT_CallTimedout);
}

bool is_certainly_not_executed(const CORBA::SystemException& e) {
  return e.completed() == CORBA::COMPLETED_NO && !is_call_timeout(e);
}

Failure unknown_start(const Failure& cause) {
  return {cause.code(), std::string(cause.what()) +
                            "; whether the robot accepted the motion is unknown: check 'corbot status', or "
                            "stop the arm with 'corbot stop'"};
}

Failure unknown_end(Corbot::Ticket ticket, const std::string& cause, bool is_known) {
  return {ExitCode::kUnreachable,
          fmt::format("{}; the outcome of motion {} is unknown; an accepted motion still ends at rest: check "
                      "'corbot status' before you go on{}",
                      cause, ticket,
                      is_known ? fmt::format(" ('corbot cancel {}' takes the motion back)", ticket) : "")};
}

Failure explain(const Corbot::BadParameter& e) {
  // The interface calls a joint "articulation"; the reason contains the joint's number.
  const std::string_view parameter = e.parameter.in();
  // So does that of a plane or box, with its name.
  if (parameter == "articulation" || parameter == "workspace" || names(e.reason.in(), parameter))
    return {ExitCode::kRefused, fmt::format("refused: {}; this command moved nothing",
                                            without_full_stop(printable(e.reason.in())))};
  return {ExitCode::kRefused,
          fmt::format("refused: {} = {}: {}; this command moved nothing", printable(e.parameter.in()),
                      plain(e.value), without_full_stop(printable(e.reason.in())))};
}

Failure explain(const Corbot::Unreachable& e, const std::string& settings) {
  const std::string reason = without_full_stop(printable(e.reason.in()));
  const bool is_far = reason.find(kTooFarWords) != std::string::npos;
  const char* hint = metres_hint(e.target.x, e.target.y, e.target.z);
  if (*hint == '\0' && is_far) hint = " ('corbot status' shows the reach)";
  return {ExitCode::kRefused, fmt::format("refused: ({}, {}, {}) m {}: {}{}; this command moved nothing{}",
                                          plain(e.target.x), plain(e.target.y), plain(e.target.z),
                                          is_far ? "is out of reach" : "cannot be reached by this motion",
                                          reason, *hint == ';' ? "" : settings, hint)};
}

Failure explain(const Corbot::LimitExceeded& e, const std::optional<Corbot::JointInfo>& joint,
                const std::string& reason) {
  std::string what = printable(e.quantity.in());
  if (what.starts_with(kWorkspaceWord))
    return {ExitCode::kRefused, fmt::format("refused: {}; this command moved nothing",
                                            what.substr(std::string_view(kWorkspaceWord).size()))};
  const std::string unit = unit_of(what, joint) + lowered_speed(e, joint);
  if (e.articulation >= 0) what += fmt::format(" of joint {}", e.articulation);
  return {ExitCode::kRefused,
          fmt::format("refused: {}: {} is not within {} to {}{}{}{}; this command moved nothing", what,
                      plain(e.value), plain(e.lower), plain(e.upper), unit, soft_limits(e, joint), reason)};
}

Failure explain(const Corbot::NotReady& e) {
  return {ExitCode::kRefused,
          fmt::format("the robot is not ready: {} (see 'corbot status' and 'corbot alarms')",
                      without_full_stop(printable(e.reason.in())))};
}

Failure explain_control(const Corbot::NotReady& e) {
  return {
      ExitCode::kRefused,
      without_full_stop(printable(e.reason.in())) +
          "; $CORBOT_ROBOT or --robot must be what 'corbot acquire' printed, and 'corbot release --force' "
          "needs no reference"};
}

Failure explain(const Corbot::Stopped& e) {
  const std::string reason = without_full_stop(printable(e.reason.in()));
  return {ExitCode::kStopped,
          "the motion was stopped before its end" + (reason.empty() ? "" : ": " + reason)};
}

Failure explain(const Corbot::QueueFull& e) {
  if (e.capacity == CORBOT_HOST_PLACES)
    return {
        ExitCode::kRefused,
        fmt::format("refused: {0} calls of this machine already wait for motions, which is the limit of "
                    "calls, or {0} motions are queued, which is the limit of the profile's [servant] queue. "
                    "Try again when one has ended, or start motions without waiting (StartMove, Progress)",
                    e.capacity)};
  return {ExitCode::kRefused,
          fmt::format("refused: {} motions are queued, which is the limit; try again when one has ended",
                      e.capacity)};
}

Failure explain(const CORBA::SystemException& e, const Address& address) {
  const auto fail = [](const std::string& text) { return Failure(ExitCode::kUnreachable, text); };
  if (is_call_timeout(e)) {
    return fail(
        fmt::format("no answer from {} in time: is the machine overloaded or the network down? "
                    "({})",
                    address.where, address.if_late));
  }
  if (CORBA::TRANSIENT::_downcast(&e) != nullptr && !address.local.empty() && is_up(address.local)) {
    return fail(
        fmt::format("the servant of '{}' is being restarted by 'corbot up': try again in a moment; "
                    "'corbot up' reports why it ended",
                    address.local));
  }
  if (const std::string host = unresolved_host(address.where);
      CORBA::TRANSIENT::_downcast(&e) != nullptr && !host.empty()) {
    return fail(
        fmt::format("'{}' is not a host that this machine can find: give its address, such as "
                    "192.168.1.5:12810/NAME, or correct the name",
                    printable(host)));
  }
  if (CORBA::TRANSIENT::_downcast(&e) != nullptr) {
    return fail(
        fmt::format("no servant at {}: start a robot there with 'corbot up PROFILE', or name another address "
                    "with {} HOST:PORT/NAME",
                    address.where, address.naming));
  }
  if (CORBA::COMM_FAILURE::_downcast(&e) != nullptr) {
    return fail(fmt::format(
        "the servant at {} closed the connection during the call; an accepted motion still ends at "
        "rest: check 'corbot status' before you go on",
        address.where));
  }
  if (CORBA::OBJECT_NOT_EXIST::_downcast(&e) != nullptr) {
    const std::string there = robot_at(address.where);
    return fail(fmt::format("the server at {} has no robot named '{}'{}", address.where,
                            printable(address.name), there.empty() ? "" : ": it has '" + there + "'"));
  }
  if (CORBA::INV_OBJREF::_downcast(&e) != nullptr || CORBA::BAD_PARAM::_downcast(&e) != nullptr) {
    return {ExitCode::kUsage,
            fmt::format("'{}' is not the address of a robot: write corbaloc::HOST:PORT/NAME, "
                        "HOST:PORT/NAME, an IOR, or the name of a robot that is up here",
                        printable(address.uri))};
  }
  if (CORBA::NO_PERMISSION::_downcast(&e) != nullptr && e.minor() == Corbot::NoPermissionNoControl) {
    return {ExitCode::kRefused,
            "refused: another client has exclusive control of the arm; 'corbot status' names the holder and "
            "the time left"};
  }
  if (CORBA::NO_PERMISSION::_downcast(&e) != nullptr && e.minor() == Corbot::NoPermissionControlEnded) {
    return {ExitCode::kRefused,
            "refused: control has ended: the lease ran out or control was released; take control again with "
            "'corbot acquire'"};
  }
  if (CORBA::NO_PERMISSION::_downcast(&e) != nullptr) {
    return {ExitCode::kRefused,
            fmt::format("the servant at {} does not allow this client this operation", address.where)};
  }
  if (CORBA::BAD_OPERATION::_downcast(&e) != nullptr || CORBA::MARSHAL::_downcast(&e) != nullptr ||
      CORBA::NO_IMPLEMENT::_downcast(&e) != nullptr) {
    return {ExitCode::kInternal, fmt::format("the servant at {} does not know this operation: compare "
                                             "'corbot version' here and on the robot's machine",
                                             address.where)};
  }
  return {ExitCode::kInternal, fmt::format("the call to {} failed in the ORB ({}, minor code {:#x}): check "
                                           "'corbot status' and the log of 'corbot up'",
                                           address.where, e._name(), e.minor())};
}

const char* to_string(Corbot::DeviceHealth health) {
  constexpr const char* kNames[] = {"closed", "open", "degraded", "lost"};
  const auto index = static_cast<std::size_t>(health);
  return index < std::size(kNames) ? kNames[index] : "unknown";
}

bool stands_by(const Corbot::DeviceInfo& device) {
  return device.health == Corbot::DeviceClosed && *device.causeText.in() != '\0';
}

std::string describe(const Corbot::DeviceInfo& device) {
  const std::string cause = printable(device.causeText.in());
  return fmt::format("{}, {}{}{}{}", printable(device.backend.in()), to_string(device.health),
                     cause.empty() ? "" : ": ", cause, device.emergencyStop ? ", EMERGENCY STOP" : "");
}

}  // namespace corbot::client
