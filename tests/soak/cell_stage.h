// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "support/process.h"

namespace corbot::soak {

/// A simulated cell of its own, in a world that outlives its processes.
class CellStage {
 public:
  /// Starts both. `programs`: directory of corbot and its programs. `planted`: the fault of the coordinator;
  /// empty: none. Throws std::runtime_error.
  CellStage(const std::filesystem::path& programs, int pieces, std::uint32_t seed,
            const std::string& planted = "");
  CellStage(const CellStage&) = delete;
  CellStage& operator=(const CellStage&) = delete;
  ~CellStage();

  /// Starts `cell up`, once what a killed one has left is gone. Empty, or what went wrong.
  std::string start();
  [[nodiscard]] bool is_started() { return up_ && up_->running(); }

  /// Everything but the world; a robot's processes are those of each robot.
  [[nodiscard]] static std::vector<std::string> victims();
  /// 0: it does not run.
  [[nodiscard]] pid_t pid_of(const std::string& victim) const;

  /// Returns the output of `corbot cell status`; empty: no reply.
  [[nodiscard]] std::string status() const;
  /// HOST:PORT/NAME.
  [[nodiscard]] std::string address(const std::string& robot) const;
  /// A person looks, and clears the Error of a robot.
  [[nodiscard]] bool clear(const std::string& robot) const;
  /// A person's hand in the world: Scene::command(). The reply; empty: none came.
  std::string tell_world(const std::string& line);
  /// A person says that a place was emptied. False: it is refused now.
  [[nodiscard]] bool exchange(const std::string& place) const;
  /// The directory of the cell's processes.
  [[nodiscard]] std::filesystem::path state_directory() const { return directory_ / "state"; }
  /// Ends the cell, then the world. Returns the world's counts; empty: it did not end as it should.
  [[nodiscard]] std::string end();
  /// From now on its directory stays, for a person who looks for the cause.
  std::filesystem::path keep();

 private:
  [[nodiscard]] std::vector<std::string> words(const std::string& program, const std::string& verb) const;
  [[nodiscard]] std::vector<std::string> environment() const;
  [[nodiscard]] test::RunResult run(std::vector<std::string> command) const;

  const int pieces_;
  const std::uint32_t seed_;
  const int ports_;
  const std::string name_;
  const std::string planted_;
  std::filesystem::path directory_;
  const std::filesystem::path programs_;
  bool is_kept_{false};
  std::optional<test::Process> world_;
  std::optional<test::Process> up_;
};

}  // namespace corbot::soak
