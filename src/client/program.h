// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "client/request.h"

namespace corbot::client {

/// One line of a program with a command.
struct Statement {
  std::size_t line;  ///< from 1
  std::string text;  ///< as written, without comment and surrounding blanks
  client::Request request;
};

struct ProgramFault {
  std::size_t line;  ///< from 1
  std::string reason;
};

struct Program {
  std::string name;  ///< its file, or "<standard input>"
  std::vector<Statement> statements;
  std::vector<ProgramFault> faults;  ///< all faults, ordered by line; a program with a fault must not run
};

inline constexpr std::size_t kMaxProgramBytes = 1u << 20;
inline constexpr std::size_t kMaxProgramLineBytes = 1000;
inline constexpr std::size_t kMostFaultsShown = 20;
inline constexpr std::size_t kMostFaultsOfNoProgram = 3;  ///< if no line is a command

/// Parses a program: one command a line, '#' begins a comment. Empty lines count. CR LF line ends and a final
/// line without one are accepted.
[[nodiscard]] Program parse_program(std::string_view text);

/// Returns the text of a file, "-" = standard input. Throws Failure if it cannot be read, is empty or too
/// large.
[[nodiscard]] std::string read_program(const std::string& file);

/// Returns "; lines 2 to 3 were done; lines 5 to 9 were not begun" for all statements except `failed`.
[[nodiscard]] std::string describe_others(const Program& program, std::size_t failed);

/// Returns "file:line: reason" for each fault up to kMostFaultsShown, one a line.
[[nodiscard]] std::string describe_faults(const Program& program, std::string_view file);

/// Throws Failure, kUsage, if the program has faults or no statement. The text has what describe_faults()
/// returns.
void check_program(const Program& program);

/// Performs one statement, the one with this index. Throws Failure.
using Perform = std::function<void(std::size_t index, const Statement& statement)>;

/// Performs all statements in order. Throws the first Failure, with name, line and text of its statement, and
/// performs no later one.
void carry_out(const Program& program, const Perform& perform);

}  // namespace corbot::client
