// SPDX-License-Identifier: Apache-2.0
// A child of the supervisor's tests: carries out its arguments in their order, with libsystemd's side of the
// protocol.
#include <fcntl.h>
#include <signal.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

namespace {

/// One line a descriptor that was passed: its name, and the name of the file behind it.
void report_descriptors(const std::string& file) {
  char** names = nullptr;
  const int count = ::sd_listen_fds_with_names(0, &names);
  std::ofstream out(file + ".new");
  for (int i = 0; i < count; ++i) {
    char path[4096] = {};
    (void)!::readlink(("/proc/self/fd/" + std::to_string(SD_LISTEN_FDS_START + i)).c_str(), path,
                      sizeof(path) - 1);
    const std::string target(path);
    out << names[i] << ' ' << target.substr(target.rfind('/') + 1) << '\n';
  }
  out.close();
  if (::rename((file + ".new").c_str(), file.c_str()) != 0) std::exit(9);
}

void store(const std::string& name, const std::string& file) {
  const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (::sd_pid_notify_with_fds(0, 0, ("FDSTORE=1\nFDNAME=" + name).c_str(), &fd, 1) <= 0) std::exit(9);
  ::close(fd);
}

[[noreturn]] void feed() {
  std::uint64_t interval_us = 0;
  if (::sd_watchdog_enabled(0, &interval_us) <= 0) std::exit(9);
  for (;;) {
    ::sd_notify(0, "WATCHDOG=1");
    ::usleep(static_cast<useconds_t>(interval_us / 20));
  }
}

void perform(const std::string& action, const std::string& value) {
  if (action == "ready") ::sd_notify(0, "READY=1");
  if (action == "status") ::sd_notify(0, ("STATUS=" + value).c_str());
  if (action == "remove") ::sd_notify(0, ("FDSTOREREMOVE=1\nFDNAME=" + value).c_str());
  if (action == "store") store(value.substr(0, value.find(':')), value.substr(value.find(':') + 1));
  if (action == "report") report_descriptors(value);
  if (action == "feed") feed();
  if (action == "signal") (void)::raise(std::atoi(value.c_str()));
  if (action == "exit") ::_exit(std::atoi(value.c_str()));
  if (action == "another-process-is-ready" && ::fork() == 0) {
    ::sd_notify(0, "READY=1");
    ::_exit(0);
  }
  while (action == "hang") ::pause();
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word(argv[i]);
    const std::size_t equals = word.find('=');
    perform(word.substr(0, equals), equals == std::string::npos ? "" : word.substr(equals + 1));
  }
}
