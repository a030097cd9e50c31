// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "soak/evidence.h"
#include "soak/ledger.h"
#include "soak/leftovers.h"
#include "soak/recording.h"
#include "support/cut_proxy.h"
#include "support/process.h"

namespace corbot::soak {

struct StageOptions {
  std::string binaries;  ///< directory of corbot
  std::string client;    ///< soak_client
  std::string profile;
  std::string scratch;  ///< an empty directory, for what is written
  std::string orb;      ///< omniorb, orbit2
  int clients{4};       ///< the first of them only reads
  std::string kept{};   ///< a file for all that the judge reads; empty: none
  std::function<void(const Cycle&)> on_cycle{};
};

/// One robot under `corbot up`, its recorder and its clients: what the soak breaks and mends.
class Stage {
 public:
  Stage(StageOptions options, const Profile& profile, std::uint64_t seed);
  ~Stage();

  /// Starts what is not running: supervisor, recorder, clients. Throws std::runtime_error when that takes too
  /// long.
  void mend();
  /// Reads what recorder and clients have printed.
  void observe();
  /// Waits, observing, until the robot serves; clears an Error that does not pass by itself, which is counted
  /// with its cause. False after a minute.
  bool recover();
  /// Ends the clients' calls: none begins anew; waits until each has its answer, and resumes and clears where
  /// nothing else would. False after a minute.
  bool quiesce();
  /// Keeps all clients from calling, from now on.
  void hold_clients();
  /// Afterwards they go on.
  void go_on();
  /// Returns the resources that these processes hold beyond those of the beginning; "" if there are none. The
  /// servant's can be counted only while the clients rest.
  std::string check_rest(const std::vector<std::string>& names);
  [[nodiscard]] std::string rest_summary() const { return rest_.summary(); }
  /// Returns tickets of accepted motions, of this supervisor's robot, that the robot does not know, though
  /// they are of the last thousand. With `ended`, it adds tickets that have not ended although the robot is
  /// at rest. Empty: none.
  std::vector<std::string> wrong_tickets(bool ended);
  /// A line for the file that is kept, see kept.h.
  void keep(const std::string& line);
  /// `corbot drive`: a joint by about a degree, signed as a client's motions are. True when it is done.
  bool drive_by_command(int joint, bool up);
  /// Calls `corbot resume`, as a person does if the client that has paused the arm got its Resume refused.
  /// Returns true when it is done.
  bool resume();
  /// `corbot stop`, not waited for.
  void stop_by_command();
  /// Ends the robot in order. Returns a list of its remains; empty: none.
  std::string take_down();

  /// 0 where there is none.
  [[nodiscard]] pid_t servant() const { return pid_of("servant_pid"); }
  [[nodiscard]] pid_t task() const { return pid_of("rt_pid"); }
  [[nodiscard]] pid_t supervisor() const { return up_ ? up_->pid() : 0; }
  [[nodiscard]] std::size_t clients() const noexcept { return clients_.size(); }
  [[nodiscard]] pid_t client(std::size_t index) const;
  [[nodiscard]] int client_number(std::size_t index) const;
  [[nodiscard]] test::CutProxy& proxy() noexcept { return proxy_; }
  [[nodiscard]] int port() const noexcept { return port_; }
  void add_client();
  void drop_last_client();
  /// The supervisor was killed, or is to be taken for dead: its robot, the recorder and the clients end with
  /// it.
  void abandon();

  [[nodiscard]] const Ledger& ledger() const noexcept { return ledger_; }
  [[nodiscard]] const Recording& recording() const noexcept { return recording_; }
  /// Why a person's Clear was needed.
  [[nodiscard]] const std::vector<Clear>& clears() const noexcept { return clears_; }
  [[nodiscard]] const std::vector<Restart>& restarts() const noexcept { return restarts_; }

 private:
  struct Client {
    int number;
    test::Process process;
    std::size_t read;
  };
  struct StopCommand {
    int number;
    test::Process process;
  };
  [[nodiscard]] test::RunResult run(std::vector<std::string> words, double seconds);
  [[nodiscard]] test::RunResult corbot(const std::vector<std::string>& arguments);
  [[nodiscard]] std::vector<std::string> environment() const;
  [[nodiscard]] pid_t pid_of(const char* key) const;
  void start_supervisor();
  void start_recorder();
  void read_lines(test::Process& process, std::size_t& read, int client);
  void report(const std::string& line);  ///< of a call that this makes itself
  void read_announcements();
  void read_stops();
  void clear(const std::string& cause);

  const StageOptions options_;
  const std::string name_;
  const int port_;
  test::CutProxy proxy_;
  std::uint64_t seed_;
  int next_client_{1};
  Ledger ledger_;
  Recording recording_;
  std::vector<Clear> clears_;
  std::unique_ptr<test::Process> up_;
  std::unique_ptr<test::Process> recorder_;
  std::size_t recorded_{0};
  std::list<Client> clients_;
  std::list<StopCommand> stops_;  ///< under way
  int commands_{0};               ///< of those that are in the ledger
  std::ofstream kept_;
  std::vector<Restart> restarts_;
  std::size_t announced_{0};       ///< of what the supervisor has logged
  std::int64_t life_begin_ns_{0};  ///< of this supervisor
  RestCheck rest_;
};

}  // namespace corbot::soak
