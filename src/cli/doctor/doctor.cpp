// SPDX-License-Identifier: Apache-2.0
#include "cli/doctor/doctor.h"

#include <fmt/format.h>
#include <omniORB4/CORBA.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "cli/arm/doubts.h"
#include "cli/doctor/device_findings.h"
#include "cli/supervise/child.h"
#include "cli/supervise/robot_processes.h"
#include "client/local_robots.h"
#include "config/load_profile.h"
#include "net/ports.h"

namespace corbot::cli {

using client::is_up;
namespace fs = std::filesystem;

namespace {

constexpr int kDefaultPriority = 80;

Finding program(const std::string& name, Level if_absent, const std::string& fix) {
  if (const auto file = find_program(name)) return {Level::kOk, name, *file, ""};
  return {if_absent, name, "not found", fix};
}

/// Returns the profile, or nothing after adding its faults to the findings.
std::optional<Profile> read_profile(const std::string& file, std::vector<Finding>& findings) {
  try {
    Profile profile = load_profile(file);
    findings.push_back({Level::kOk, "profile",
                        fmt::format("{}: robot '{}', {} joints, family '{}'", file, profile.name,
                                    profile.arm.dof, profile.arm.kinematics.family()),
                        ""});
    return profile;
  } catch (const ConfigError& error) {
    for (const auto& fault : error.faults()) {
      const bool is_file = fault.line == 0 && fault.key.empty();
      findings.push_back({Level::kFail, "profile", fault.text(),
                          is_file ? "give the path of a profile" : "correct that line"});
    }
    return std::nullopt;
  }
}

Finding port(const Profile& profile) {
  const std::string endpoint = net::endpoint_text(profile.endpoint_host, profile.port);
  const auto running = is_up(profile.name) ? client::read_state(profile.name) : std::nullopt;
  if (running)
    return {Level::kOk, "port", fmt::format("'{}' is up at {}", profile.name, running->endpoint), ""};
  const std::string why = client::endpoint_fault(profile.endpoint_host, profile.port);
  if (why.empty()) return {Level::kOk, "port", endpoint + " is free", ""};
  return {Level::kFail, "port", why, "end that program, or use corbot up --endpoint HOST:PORT"};
}

/// Returns the robot that was started from this profile, under any name, or the one with this name; "" if
/// none is up.
std::string running_robot(const std::string& profile_file, const std::string& name) {
  for (const std::string& robot : client::robots_up()) {
    const auto state = client::read_state(robot);
    std::error_code error;
    if (state && fs::equivalent(state->profile, profile_file, error)) return robot;
  }
  return is_up(name) || !find_robot_processes(name).empty() ? name : "";
}

const char* to_string(Level level) {
  switch (level) {
    case Level::kOk:
      return "ok";
    case Level::kWarn:
      return "warn";
    default:
      return "fail";
  }
}

}  // namespace

std::vector<Finding> examine_installation(const std::string& profile_file) {
  std::vector<Finding> findings;
  findings.push_back(program("corbot-rt", Level::kFail, "install corbot completely"));
  findings.push_back(program("corbot-servant", Level::kFail, "install corbot completely"));
  findings.push_back(program("omniNames", Level::kWarn,
                             "only 'corbot up --naming' needs it: apt install omniorb-nameserver"));
  findings.push_back({Level::kOk, "ORB", fmt::format("omniORB {}", omniORB::versionString()), ""});
  if (profile_file.empty()) return findings;
  const auto profile = read_profile(profile_file, findings);
  if (!profile) return findings;
  for (const std::string& doubt : doubts_of(*profile, workspace_of(profile->arm)))
    findings.push_back(
        {Level::kWarn, "geometry", doubt, "see docs/profiles.md; 'corbot kinematics' shows the arm"});
  findings.push_back(port(*profile));
  // The robot has its device open: a second program on the line would disturb it.
  const std::string running = running_robot(profile_file, profile->name);
  for (auto& finding :
       running.empty() ? examine_devices(*profile, {}) : examine_running(*profile, running, {})) {
    findings.push_back(std::move(finding));
  }
  return findings;
}

bool doctor(const std::string& profile_file) {
  std::vector<Finding> findings = examine_installation(profile_file);
  int priority = kDefaultPriority;
  std::optional<int> cpu;
  if (!profile_file.empty()) {
    std::vector<Finding> already_reported;
    if (const auto profile = read_profile(profile_file, already_reported)) {
      priority = profile->priority;
      cpu = profile->cpu;
    }
  }
  for (auto& finding : examine_privileges(priority)) findings.push_back(std::move(finding));
  for (auto& finding : examine_machine({}, cpu)) findings.push_back(std::move(finding));
  for (const auto& finding : findings) {
    fmt::print("{:<4}  {:<14} {}\n", to_string(finding.level), finding.subject, finding.text);
    if (finding.level != Level::kOk) fmt::print("      {:<14} -> {}\n", "", finding.fix);
  }
  const auto count = [&](Level level) {
    return std::count_if(findings.begin(), findings.end(), [&](const auto& f) { return f.level == level; });
  };
  fmt::print("{} ok, {} to consider, {} to fix\n", count(Level::kOk), count(Level::kWarn),
             count(Level::kFail));
  return count(Level::kFail) == 0;
}

}  // namespace corbot::cli
