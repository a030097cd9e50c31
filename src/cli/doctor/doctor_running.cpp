// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "cli/doctor/device_findings.h"
#include "client/client.h"
#include "client/local_robots.h"
#include "net/ports.h"

namespace corbot::cli {

using client::Address;
using client::Client;
using client::Failure;

namespace {

constexpr double kAnswerWithin_s = 5.0;

/// Returns the address. A robot that was started by hand or by systemd has no file of `corbot up`.
Address address_of(const Profile& profile, const std::string& robot) {
  if (client::is_up(robot)) return client::find_robot(robot);
  const std::string where = net::endpoint_text(profile.endpoint_host, profile.port);
  return {fmt::format("corbaloc::{}/{}", where, profile.name), profile.name, where};
}

Finding device(const Corbot::DeviceInfo& info) {
  const std::string text =
      fmt::format("the robot is up, and its device is as follows: {}", client::describe(info));
  switch (info.health) {
    case Corbot::DeviceOpen:
      return info.emergencyStop ? device_warning(text, "release the emergency stop, then 'corbot clear'")
                                : device_ok(text);
    case Corbot::DeviceDegraded:
      return device_warning(text, "docs/alarms.md has the causes; 'corbot diagnostics' has the times");
    case Corbot::DeviceClosed:
      if (client::stands_by(info)) {
        return device_warning(text, "put the causes of the alarms right, then 'corbot clear'");
      }
      return device_failure(text, "no real-time task runs: 'corbot status', and the log of 'corbot up'");
    default:
      return device_failure(
          text,
          "docs/alarms.md has the causes; with the robot down, 'corbot doctor PROFILE' asks the "
          "device itself");
  }
}

}  // namespace

Findings examine_running(const Profile& profile, const std::string& robot, const DeviceAccess& access) {
  Findings findings;
  try {
    Client client(address_of(profile, robot), kAnswerWithin_s);
    const Corbot::DeviceInfo_var info = client.call([](auto& arm) { return arm.Device(); });
    findings.push_back(device(info.in()));
    const Corbot::AlarmList_var alarms = client.call([](auto& arm) { return arm.Alarms(); });
    for (CORBA::ULong i = 0; i < alarms->length(); ++i) {
      const auto& alarm = alarms.in()[i];
      if (!alarm.active) continue;
      findings.push_back(
          device_warning(fmt::format("alarm {}: {}", alarm.code, client::printable(alarm.text.in())),
                         "put its cause right, then 'corbot clear'; docs/alarms.md"));
    }
  } catch (const Failure& failure) {
    findings.push_back(
        device_failure(fmt::format("the robot is up, and cannot be asked: {}", failure.what()),
                       "'corbot down', then ask again: with the robot down the device itself is asked"));
  }
  examine_lines(profile, access, true, findings);
  return findings;
}

}  // namespace corbot::cli
