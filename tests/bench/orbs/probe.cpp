// SPDX-License-Identifier: Apache-2.0
#include "orbs/probe.h"

#include <chrono>
#include <sstream>
#include <stdexcept>

namespace corbot::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kPatience_s = 60.0;  // generous: it only ends a hang

template <class Function>
std::vector<double> timed(int count, Function&& call) {
  std::vector<double> us;
  us.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const auto begin = Clock::now();
    call();
    us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
  }
  return us;
}

}  // namespace

OmniProbe::OmniProbe(CORBA::ORB_ptr orb, const std::string& reference) {
  CORBA::Object_var object = orb->string_to_object(reference.c_str());
  robot_ = Corbot::Robot::_narrow(object);
  if (CORBA::is_nil(robot_)) throw std::runtime_error(reference + " is no robot");
  here_ = robot_->CartCoord();
  robot_->Move(here_.x, here_.y, here_.z, 0.0, 0.0);
  here_ = robot_->CartCoord();  // from here on a Move leads exactly nowhere
}

std::vector<double> OmniProbe::measure(Call call, int count) {
  if (call == Call::kMove) {
    return timed(count, [this] { robot_->Move(here_.x, here_.y, here_.z, 0.0, 0.0); });
  }
  return timed(count, [this] { (void)robot_->CartCoord(); });
}

Orbit2Probe::Orbit2Probe(const std::string& program, const std::string& reference)
    : client_({program, reference}) {
  if (!client_.wait_line("ready", test::within(kPatience_s))) throw std::runtime_error(client_.errors());
}

std::vector<double> Orbit2Probe::measure(Call call, int count) {
  client_.send((call == Call::kMove ? "move " : "read ") + std::to_string(count));
  std::istringstream line(client_.wait_line("", test::within(kPatience_s)).value_or(""));
  std::vector<double> us;
  for (double ns = 0.0; line >> ns;) us.push_back(ns / 1000.0);
  if (us.size() != static_cast<std::size_t>(count)) {
    throw std::runtime_error("an ORBit2 client has failed: " + client_.errors());
  }
  return us;
}

}  // namespace corbot::bench
