// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/process_name.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <sstream>
#include <string_view>
#include <system_error>

#include "client/explain.h"

namespace corbot::cell {

namespace {

constexpr std::string_view kWaits = "/waits";
constexpr std::size_t kMost = 64 - kWaits.size();  // characters, within the interface's bound
constexpr std::size_t kBootPart = 8;               // characters of the boot's id
constexpr std::size_t kProgramPart = 18;           // characters, so that each program cuts the host alike
constexpr int kStartAfterName = 20;                // stat: start in field 22, program in field 2

std::string first_line(const char* path) {
  std::ifstream stream(path);
  std::string line;
  if (std::getline(stream, line)) return line;
  throw client::Failure(client::ExitCode::kInternal, fmt::format("cannot read {}", path));
}

/// Returns the clock ticks from boot to the start of a process. `process` is a PID or "self".
std::string start_ticks(const std::string& process) {
  const std::string stat = first_line(("/proc/" + process + "/stat").c_str());
  std::istringstream fields(stat.substr(stat.rfind(')') + 1));  // the name may contain spaces
  std::string field;
  for (int i = 0; i < kStartAfterName; ++i) fields >> field;
  return field;
}

}  // namespace

std::string process_name() {
  const std::string boot = first_line("/proc/sys/kernel/random/boot_id").substr(0, kBootPart);
  const std::string process = fmt::format("/{}/{}/{}", boot, ::getpid(), start_ticks("self"));
  char host[65] = {};
  ::gethostname(host, sizeof host - 1);
  // The host is for people only, so a long host name is truncated.
  const std::string where = client::printable(fmt::format("@{}", host));
  return client::printable(program_invocation_short_name).substr(0, kProgramPart) +
         where.substr(0, kMost - kProgramPart - process.size()) + process;
}

bool is_of_dead_process(const std::string& name) {
  // The machine is "@HOST/BOOT". A container has its own processes and another host name.
  const auto place_in = [](const std::string& text) {
    return text.substr(std::min(text.find('@'), text.size()));
  };
  const std::string own = place_in(process_name());
  const std::string machine = own.substr(0, own.rfind('/', own.rfind('/') - 1) + 1);
  const std::string named = place_in(name);
  if (!named.starts_with(machine)) return false;
  std::string process = named.substr(machine.size());
  if (is_waiting_name(process)) process.erase(process.size() - kWaits.size());
  const auto slash = process.find('/');
  const std::string pid = process.substr(0, slash);
  pid_t id = 0;
  const auto [end, error] = std::from_chars(pid.data(), pid.data() + pid.size(), id);
  if (slash == std::string::npos || error != std::errc() || end != pid.data() + pid.size() || id <= 0)
    return false;
  try {
    return start_ticks(pid) != process.substr(slash + 1);
  } catch (const client::Failure&) {
    return ::kill(id, 0) != 0 && errno == ESRCH;  // /proc may hide the processes of other users
  }
}

std::string waiting_name(const std::string& name) { return name + std::string(kWaits); }

bool is_waiting_name(const std::string& name) { return name.ends_with(kWaits); }

}  // namespace corbot::cell
