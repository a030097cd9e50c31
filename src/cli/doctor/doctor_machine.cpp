// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/capability.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "cli/doctor/doctor.h"
#include "client/number.h"

namespace corbot::cli {

using client::parse_integer;

namespace {

constexpr std::uint64_t kLockedMemory = 256u << 20;

std::string first_line(const std::string& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

Finding ok(std::string subject, std::string text) {
  return {Level::kOk, std::move(subject), std::move(text), ""};
}

Finding kernel(const MachineFiles& files) {
  utsname name{};
  ::uname(&name);
  const std::string text = fmt::format("{} {}", name.sysname, name.release);
  if (first_line(files.sys + "/kernel/realtime") == "1" ||
      std::string_view(name.version).find("PREEMPT_RT") != std::string_view::npos) {
    return ok("kernel", text + ", PREEMPT_RT");
  }
  return {Level::kWarn, "kernel", text + ", not PREEMPT_RT: wake-ups may be late by milliseconds",
          "install one: apt install linux-image-rt-amd64, and boot it"};
}

Finding governor(const MachineFiles& files, int cpu) {
  const std::string number = fmt::format("{}", std::max(cpu, 0));
  const std::string found =
      first_line(files.sys + "/devices/system/cpu/cpu" + number + "/cpufreq/scaling_governor");
  if (found.empty()) return ok("cpu frequency", "not governed here (virtual machine, or fixed)");
  if (found == "performance") return ok("cpu frequency", "governor performance");
  return {Level::kWarn, "cpu frequency", "governor " + found + ": the first cycles after a pause run slowly",
          "cpupower frequency-set -g performance"};
}

Finding clock_source(const MachineFiles& files) {
  const std::string found =
      first_line(files.sys + "/devices/system/clocksource/clocksource0/current_clocksource");
  if (found.empty()) return ok("clock source", "not reported by this kernel");
  if (found == "hpet" || found == "acpi_pm" || found == "jiffies" || found == "refined-jiffies") {
    return {Level::kWarn, "clock source", found + ": slow to read",
            "see why the kernel rejected the fast one: dmesg | grep -i clocksource"};
  }
  return ok("clock source", found);
}

Finding isolation(const MachineFiles& files, std::optional<int> wanted) {
  if (!wanted) return ok("cpu", "set by a profile; none is given");
  const int cpu = *wanted;
  const std::string isolated = first_line(files.sys + "/devices/system/cpu/isolated");
  const std::string online = first_line(files.sys + "/devices/system/cpu/online");
  if (cpu < 0) return ok("cpu", "any: the profile binds the loop to none");
  if (!online.empty() && !cpu_list_contains(online, cpu)) {
    return {Level::kFail, "cpu", fmt::format("the profile asks for cpu {}; online are {}", cpu, online),
            "set [loop] cpu in the profile to one of them, or to -1"};
  }
  if (cpu_list_contains(isolated, cpu)) return ok("cpu", fmt::format("cpu {} is isolated", cpu));
  return {Level::kWarn, "cpu", fmt::format("cpu {} is not isolated: other programs run on it", cpu),
          fmt::format("add isolcpus={0} nohz_full={0} to the kernel's command line", cpu)};
}

/// Examines the kernel's automatic groups of tasks. They were seen to hold back the kernel's own worker for
/// received bytes, on Linux 6.18: docs/figures.md, "Automatic groups of tasks".
Finding task_groups(const MachineFiles& files) {
  if (first_line(files.proc + "/sys/kernel/sched_autogroup_enabled") != "1") return ok("task groups", "none");
  return {Level::kWarn, "task groups",
          "the kernel groups tasks: beside programs that compute, a serial device's replies may come seconds "
          "late",
          "sysctl kernel.sched_autogroup_enabled=0"};
}

/// Checks that shared memory can be sealed against writing by others. Servant and real-time task share such
/// memory.
Finding shared_memory() {
  const int memory = ::memfd_create("corbot.doctor", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  const bool is_sealed = memory >= 0 && ::fcntl(memory, F_ADD_SEALS, F_SEAL_FUTURE_WRITE) == 0;
  const int error = errno;
  if (memory >= 0) ::close(memory);
  if (is_sealed) return ok("shared memory", "can be sealed");
  return {Level::kFail, "shared memory", fmt::format("cannot be sealed: {}", std::strerror(error)),
          "needs Linux 5.1 or newer"};
}

/// Returns true if capability `bit` is in this process's effective set.
bool has_capability(int bit) {
  std::ifstream stream("/proc/self/status");
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with("CapEff:")) continue;
    std::uint64_t set = 0;
    std::istringstream(line.substr(7)) >> std::hex >> set;
    return (set >> bit & 1) != 0;
  }
  return false;
}

}  // namespace

bool cpu_list_contains(std::string_view list, int cpu) {
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    const std::string_view part = list.substr(0, comma);
    const std::size_t dash = std::min(part.find('-'), part.size());
    const auto first = parse_integer(part.substr(0, dash));
    const auto last = dash < part.size() ? parse_integer(part.substr(dash + 1)) : first;
    if (first && last && *first <= cpu && cpu <= *last) return true;
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return false;
}

std::vector<Finding> examine_machine(const MachineFiles& files, std::optional<int> cpu) {
  return {kernel(files),         clock_source(files), governor(files, cpu.value_or(-1)),
          isolation(files, cpu), task_groups(files),  shared_memory()};
}

std::vector<Finding> examine_privileges(int priority) {
  std::vector<Finding> findings;
  rlimit limit{};
  ::getrlimit(RLIMIT_RTPRIO, &limit);
  if (has_capability(CAP_SYS_NICE)) {
    findings.push_back(ok("priority", "CAP_SYS_NICE"));
  } else if (limit.rlim_cur >= static_cast<rlim_t>(priority)) {
    findings.push_back(ok("priority", fmt::format("RLIMIT_RTPRIO {}", limit.rlim_cur)));
  } else {
    findings.push_back(
        {Level::kWarn, "priority",
         fmt::format("RLIMIT_RTPRIO is {}, the loop needs {}: it will run best-effort", limit.rlim_cur,
                     priority),
         "put '@corbot - rtprio 98' into /etc/security/limits.d/corbot.conf, join the group corbot, "
         "log in again"});
  }
  ::getrlimit(RLIMIT_MEMLOCK, &limit);
  if (has_capability(CAP_IPC_LOCK) || limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >= kLockedMemory) {
    findings.push_back(ok("memory lock", "enough may be locked"));
  } else {
    findings.push_back(
        {Level::kWarn, "memory lock",
         fmt::format("RLIMIT_MEMLOCK is {} KiB: page faults may delay the loop", limit.rlim_cur >> 10),
         "put '@corbot - memlock unlimited' into /etc/security/limits.d/corbot.conf, log in again"});
  }
  return findings;
}

}  // namespace corbot::cli
