// SPDX-License-Identifier: Apache-2.0
// Measures the time that the servants add to their ORBs, over TCP and over Unix sockets. A client calls
// CartCoord and a zero-length Move through corbot-servant and corbot-servant-orbit2. The peer is a bare echo
// on the same ORB as client and servant. Short blocks of all alternate, so that a busy machine hits all
// alike.
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <list>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "orbs/probe.h"
#include "orbs/servers.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/process.h"

namespace {

using namespace corbot::bench;

const std::string kBench = CORBOT_BINARY_DIR "/bench";

/// Calls of one kind: so many of each subject, in blocks. The first ones of a block are not counted: they
/// find caches that others have used meanwhile, and the real-time task at another place of its cycle.
struct Plan {
  Call call;
  int total;
  int block;
  int lead_in;
};

struct Series {
  std::vector<double> us;
  double percentile(double p) {
    std::sort(us.begin(), us.end());
    return us[std::min(us.size() - 1, static_cast<std::size_t>(p * static_cast<double>(us.size())))];
  }
};

struct Subject {
  explicit Subject(std::unique_ptr<Probe> a_probe) : probe(std::move(a_probe)) {}
  std::unique_ptr<Probe> probe;
  Series reads;
  Series moves;
};

/// One line of the table.
struct Cell {
  std::string name;
  Subject servant;
  Subject echo;
  std::unique_ptr<Subject> other_echo;  ///< with a thread a connection; ORBit2's only
};

std::string free_address() { return fmt::format("127.0.0.1:{}", corbot::test::free_port()); }

void add_omniorb(std::list<Cell>& cells, Servers& servers, const Scratch& scratch, CORBA::ORB_ptr orb) {
  const std::string name = corbot::test::unique_name("bench");
  const std::string tcp = free_address();
  const std::string local = scratch.socket("omniorb");
  servers.start_robot("corbot-servant", name, {"--endpoint", tcp, "--unix", local});
  const std::string echo_tcp = free_address();
  const std::string echo_local = scratch.socket("omniorb-echo");
  servers.start({kBench + "/bench_orbs_omniorb_server", "-ORBendPoint", "giop:tcp:" + echo_tcp,
                 "-ORBendPoint", "giop:unix:" + echo_local});
  const auto add = [&](const std::string& cell, const std::string& prefix, const std::string& robot_at,
                       const std::string& echo_at) {
    cells.push_back({cell, Subject(std::make_unique<OmniProbe>(orb, prefix + robot_at + "/" + name)),
                     Subject(std::make_unique<OmniProbe>(orb, prefix + echo_at + "/echo")), nullptr});
  };
  add("omniORB TCP", "corbaloc::", tcp, echo_tcp);
  add("omniORB Unix socket", "corbaloc:omniunix:", local + ":", echo_local + ":");
}

#ifdef CORBOT_HAS_ORBIT2
void add_orbit2(std::list<Cell>& cells, Servers& servers, const Scratch& scratch) {
  const auto probe = [](const std::string& reference) {
    return std::make_unique<Orbit2Probe>(kBench + "/bench_orbs_orbit2_client", reference);
  };
  const auto echo = [&](const std::string& address, const std::string& thread) {
    return probe(servers.start({kBench + "/bench_orbs_orbit2_server", address, thread}));
  };
  const auto add = [&](const std::string& cell, const std::vector<std::string>& address,
                       const std::string& echo_at, const std::string& other_echo_at) {
    const std::string servant =
        servers.start_robot("corbot-servant-orbit2", corbot::test::unique_name("bench"), address);
    cells.push_back({cell, Subject(probe(servant)), Subject(echo(echo_at, "request")),
                     std::make_unique<Subject>(echo(other_echo_at, "connection"))});
  };
  add("ORBit2 TCP", {"--endpoint", free_address()}, free_address(), free_address());
  add("ORBit2 Unix socket", {"--unix", scratch.socket("orbit2")}, scratch.socket("orbit2-echo"),
      scratch.socket("orbit2-other-echo"));
}
#endif

volatile sig_atomic_t interrupted = 0;

/// Every subject in turn, a block each; in another order each time.
void measure(std::vector<Subject*> subjects, const Plan& plan) {
  std::mt19937 random(1);  // the same order in every run
  for (int done = 0; done < plan.total; done += plan.block) {
    std::shuffle(subjects.begin(), subjects.end(), random);
    for (Subject* subject : subjects) {
      if (interrupted != 0) throw std::runtime_error("interrupted");
      const std::vector<double> us = subject->probe->measure(plan.call, plan.lead_in + plan.block);
      std::vector<double>& all = plan.call == Call::kRead ? subject->reads.us : subject->moves.us;
      all.insert(all.end(), us.begin() + plan.lead_in, us.end());
    }
  }
}

void print_pair(const std::string& what, Series& ours, Series& bare) {
  fmt::print("{:<32} servant p50 {:7.1f} p99 {:7.1f} us   bare p50 {:7.1f} p99 {:7.1f} us", what,
             ours.percentile(0.5), ours.percentile(0.99), bare.percentile(0.5), bare.percentile(0.99));
}

void report_reads(std::list<Cell>& cells) {
  for (Cell& cell : cells) {
    print_pair("CartCoord, " + cell.name, cell.servant.reads, cell.echo.reads);
    fmt::print("   ratio p50 {:.3f}\n", cell.servant.reads.percentile(0.5) / cell.echo.reads.percentile(0.5));
  }
  for (Cell& cell : cells) {
    if (!cell.other_echo) continue;
    Series& bare = cell.other_echo->reads;
    fmt::print("{:<67}   bare p50 {:7.1f} p99 {:7.1f} us   a thread a request: {:.3f} of it\n",
               "CartCoord, " + cell.name + ", a thread a connection", bare.percentile(0.5),
               bare.percentile(0.99), cell.echo.reads.percentile(0.5) / bare.percentile(0.5));
  }
}

void report_moves(std::list<Cell>& cells) {
  for (Cell& cell : cells) {
    print_pair("Move, " + cell.name, cell.servant.moves, cell.echo.moves);
    fmt::print("\n");
  }
  fmt::print("No ratio: a servant's Move waits for the next cycle of 1 ms, an echo's for nothing\n");
  if (cells.size() != 4) return;
  std::vector<double> p50;
  for (Cell& cell : cells) p50.push_back(cell.servant.moves.percentile(0.5));
  fmt::print("Move p50, ORBit2's servant less omniORB's: TCP {:+.1f} us, Unix socket {:+.1f} us\n",
             p50[2] - p50[0], p50[3] - p50[1]);
}

}  // namespace

int main(int argc, char** argv) try {
  const int calls = argc > 1 ? std::max(1, std::atoi(argv[1])) : 20000;
  const Plan reads{Call::kRead, calls, 200, 20};
  const Plan moves{Call::kMove, std::max(1, calls * 3 / 200), 10, 2};
  ::signal(SIGINT, [](int) { interrupted = 1; });
  ::signal(SIGTERM, [](int) { interrupted = 1; });

  const Scratch scratch;
  Servers servers;
  int orb_argc = 1;
  CORBA::ORB_var orb = CORBA::ORB_init(orb_argc, argv);
  std::list<Cell> cells;
  add_omniorb(cells, servers, scratch, orb);
#ifdef CORBOT_HAS_ORBIT2
  add_orbit2(cells, servers, scratch);
#endif
  std::vector<Subject*> subjects;
  for (Cell& cell : cells) {
    subjects.push_back(&cell.servant);
    subjects.push_back(&cell.echo);
    if (cell.other_echo) subjects.push_back(cell.other_echo.get());
  }
  for (Subject* subject : subjects) (void)subject->probe->measure(Call::kRead, 1000);  // warms up
  measure(subjects, reads);
  measure(subjects, moves);

  fmt::print("{} reads each, in alternating blocks of {}; bound of the ratio: 1.3\n",
             cells.front().servant.reads.us.size(), reads.block);
  report_reads(cells);
  fmt::print("{} zero-length Moves each, in alternating blocks of {}\n",
             cells.front().servant.moves.us.size(), moves.block);
  report_moves(cells);
#ifndef CORBOT_HAS_ORBIT2
  fmt::print("ORBit2: not found\n");
#endif
  cells.clear();
  orb->destroy();
  return 0;
} catch (const CORBA::Exception& error) {
  fmt::print(stderr, "bench_orbs: CORBA {}\n", error._name());
  return 1;
} catch (const std::exception& error) {
  fmt::print(stderr, "bench_orbs: {}\n", error.what());
  return 1;
}
