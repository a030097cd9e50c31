// SPDX-License-Identifier: Apache-2.0
// Breaks a robot under `corbot up` at random, again and again, while clients move it: kill, freeze and thaw of client,
// servant, real-time task and supervisor, cut and half-open connections, floods, alone and in pairs. Every set-point is
// recorded and judged afterwards (verdict.h). The seed repeats the sequence of faults, not the instants of the threads.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <functional>
#include <map>
#include <random>

#include "config/load_profile.h"
#include "soak/stage.h"
#include "soak/verdict.h"

namespace corbot::soak {
namespace {

std::int64_t now_ns() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

/// One thing broken: done at once, undone after a while.
struct Fault {
  std::string what;
  std::function<void()> undo;
  double lasts_s{0.0};
};

class Soak {
 public:
  Soak(Stage& stage, std::uint64_t seed, bool verbose) : stage_(stage), random_(seed), verbose_(verbose) {}

  /// False when the robot did not come back.
  bool run(int faults) {
    stage_.mend();
    if (!stage_.recover()) return false;
    for (int i = 0; i < faults;) {
      idle(real(0.05, 0.6));
      Disturbance disturbance{now_ns(), 0, ""};
      std::vector<Fault> broken;
      for (int n = between(1, 10) <= 3 ? 2 : 1; n > 0; --n) {
        broken.push_back(break_one());
        disturbance.what += (disturbance.what.empty() ? "" : " + ") + broken.back().what;
        ++counts_[broken.back().what];
        ++i;
      }
      if (verbose_) fmt::print("{} {}\n", i, disturbance.what);
      std::fflush(stdout);
      double lasts_s = 0.0;
      for (const Fault& fault : broken) lasts_s = std::max(lasts_s, fault.lasts_s);
      idle(lasts_s);
      for (const Fault& fault : broken) {
        if (fault.undo) fault.undo();
      }
      const bool back = stage_.recover();
      disturbance.end_ns = now_ns() + 1'000'000'000;  // what was under way comes to its end
      disturbances_.push_back(disturbance);
      if (!back) {
        fmt::print("the robot did not come back within a minute after: {}\n", disturbance.what);
        return false;
      }
    }
    idle(1.0);  // what the last fault killed is dead by now, and is begun again
    return stage_.recover();
  }

  [[nodiscard]] const std::vector<Disturbance>& disturbances() const { return disturbances_; }
  [[nodiscard]] const std::map<std::string, int>& counts() const { return counts_; }

 private:
  int between(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  void idle(double seconds) {
    const std::int64_t end_ns = now_ns() + static_cast<std::int64_t>(seconds * 1e9);
    while (now_ns() < end_ns) {
      stage_.observe();
      const timespec time{0, 10'000'000};
      ::nanosleep(&time, nullptr);
    }
  }

  Fault kill_process(const std::string& what, pid_t pid) {
    if (pid > 0) ::kill(pid, SIGKILL);
    return {"kill " + what, {}, 0.0};
  }
  Fault freeze(const std::string& what, pid_t pid) {
    if (pid > 0) ::kill(pid, SIGSTOP);
    return {"freeze " + what,
            [pid] {
              if (pid > 0) ::kill(pid, SIGCONT);
            },
            real(0.02, 3.0)};
  }
  pid_t some_client() {
    return stage_.clients() == 0
               ? 0
               : stage_.client(static_cast<std::size_t>(between(0, static_cast<int>(stage_.clients()) - 1)));
  }

  Fault flood_with_connections() {
    std::vector<int> open;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(stage_.port()));
    for (int i = 0; i < 400; ++i) {
      const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
      if (fd < 0) break;
      (void)::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address));
      open.push_back(fd);
    }
    return {"flood of connections",
            [open] {
              for (const int fd : open) ::close(fd);
            },
            real(0.2, 1.0)};
  }
  Fault flood_with_clients() {
    for (int i = 0; i < 12; ++i) stage_.add_client();
    return {"flood of clients",
            [this] {
              while (stage_.clients() > 4) {
                ::kill(stage_.client(stage_.clients() - 1), SIGKILL);
                stage_.observe();
                stage_.drop_last_client();
              }
            },
            real(0.5, 1.5)};
  }
  Fault half_open() {
    stage_.proxy().fall_silent();
    return {"half-open connections", [this] { stage_.proxy().cut(); }, real(0.1, 3.0)};
  }
  Fault cut() {
    stage_.proxy().cut();
    return {"cut connections", {}, 0.0};
  }

  Fault break_one() {
    switch (between(0, 11)) {
      case 0:
        return kill_process("client", some_client());
      case 1:
        return kill_process("servant", stage_.servant());
      case 2:
        return kill_process("task", stage_.task());
      case 3:
        return kill_process("supervisor", stage_.supervisor());
      case 4:
        return freeze("client", some_client());
      case 5:
        return freeze("servant", stage_.servant());
      case 6:
        return freeze("task", stage_.task());
      case 7:
        return freeze("supervisor", stage_.supervisor());
      case 8:
        return half_open();
      case 9:
        return flood_with_connections();
      case 10:
        return flood_with_clients();
      default:
        return cut();
    }
  }

  Stage& stage_;
  std::mt19937_64 random_;
  bool verbose_;
  std::vector<Disturbance> disturbances_;
  std::map<std::string, int> counts_;
};

int run(int faults, std::uint64_t seed, bool verbose, const StageOptions& options) {
  const Profile profile = load_profile(options.profile);
  fmt::print("{} faults, --seed {}, --orb {}\n", faults, seed, options.orb);
  std::fflush(stdout);
  Stage stage(options, profile, seed);
  Soak soak(stage, seed, verbose);
  bool good = soak.run(faults);
  if (good && !stage.quiesce()) {
    fmt::print("a caller has no answer\n");
    good = false;
  }
  for (const std::string& ticket : good ? stage.open_tickets() : std::vector<std::string>{}) {
    fmt::print("{}: not ended\n", ticket);
    good = false;
  }
  const std::string left = stage.take_down();
  const Verdict verdict =
      judge(profile, stage.ledger(), stage.recording(), soak.disturbances(), stage.clears());
  for (const auto& [what, count] : soak.counts()) fmt::print("{:6} {}\n", count, what);
  for (const auto& [cause, count] : verdict.clears) fmt::print("{:6} cleared: {}\n", count, cause);
  fmt::print(
      "{} calls, {} of them by clients that were killed before the answer; {} motions, {} to their end\n",
      verdict.calls, verdict.unanswered, verdict.motions, verdict.whole_motions);
  fmt::print("{} set-points, {} interruptions of the recording\n", stage.recording().cycles(),
             stage.recording().gaps());
  fmt::print("slowest answer {:.3f} s, undisturbed and not waiting for a motion {:.3f} s\n",
             verdict.slowest_s, verdict.slowest_undisturbed_s);
  if (!left.empty()) fmt::print("left behind:\n{}", left);
  constexpr std::size_t kShown = 40;
  for (std::size_t i = 0; i < std::min(kShown, verdict.faults.size()); ++i)
    fmt::print("FAULT {}\n", verdict.faults[i]);
  if (verdict.faults.size() > kShown) fmt::print("and {} more faults\n", verdict.faults.size() - kShown);
  const bool passed = good && left.empty() && verdict.faults.empty() && verdict.whole_motions > 0;
  fmt::print("{}\n", passed ? "passed" : "FAILED");
  return passed ? 0 : 1;
}

}  // namespace
}  // namespace corbot::soak

int main(int argc, char** argv) {
  CLI::App app{"Breaks a robot at random and judges every set-point and every answer", "soak"};
  int faults = 100;
  std::uint64_t seed = std::random_device{}();
  bool verbose = false;
  corbot::soak::StageOptions options{CORBOT_BIN_DIR, CORBOT_SOAK_CLIENT, CORBOT_PROFILE, "", "omniorb"};
  app.add_option("--faults", faults, "how many")->check(CLI::Range(1, 100'000))->capture_default_str();
  app.add_option("--seed", seed, "repeats a sequence of faults");
  app.add_option("--orb", options.orb)->check(CLI::IsMember({"omniorb", "orbit2"}))->capture_default_str();
  app.add_option("--profile", options.profile, "of the robot")->capture_default_str();
  app.add_flag("--verbose", verbose, "say what is broken as it is");
  CLI11_PARSE(app, argc, argv);
  std::string scratch = CORBOT_SCRATCH_DIR "/soak-XXXXXX";
  options.scratch = ::mkdtemp(scratch.data());
  ::signal(SIGPIPE, SIG_IGN);
  int status = 1;
  try {
    status = corbot::soak::run(faults, seed, verbose, options);
  } catch (const std::exception& error) {
    fmt::print("FAILED: {}\n", error.what());
  }
  std::filesystem::remove_all(options.scratch);
  return status;
}
