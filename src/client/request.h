// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

// The commands for the robot: the same on the command line and in a program.

namespace corbot::client {

enum class Verb {
  // Motions.
  kMove,
  kMoveS,
  kMoveC,
  kDrive,
  kJoints,
  kReady,
  kDelay,
  kOpen,
  kClose,
  kGripper,
  kMovePose,
  kMoveRelative,
  // Settings.
  kSpeed,
  kPitch,
  kLimit,
  kOrientation,
  kTool,
  kBase,
  kFrames,
  kWorkspace,
  kOverride,
  // Commands that act at once and are not allowed in programs.
  kStop,
  kCancel,
  kPause,
  kResume,
  kHold,
  kClear,
  kAcquire,
  kRenew,
  kRelease,
};

/// A checked command, in the units of the CORBA interface: metres, degrees, seconds, percent.
struct Request {
  Verb verb{};
  std::vector<double> numbers;           ///< the positional arguments in order
  double above_m{0};                     ///< --above
  double time_s{0};                      ///< --time; 0 = as fast as the limits allow
  int joint{-1};                         ///< --joint; −1 = none
  std::string joint_name{};              ///< instead of the number of the joint; empty: none
  bool all{false};                       ///< --all
  bool force{false};                     ///< --force
  bool reset{false};                     ///< --reset
  bool line{false};                      ///< --line
  bool tool{false};                      ///< --tool
  double lease_s{60};                    ///< --lease
  std::optional<std::string> who{};      ///< --who; nothing = user and machine
  std::optional<std::string> shape{};    ///< name of a plane or box
  std::optional<std::uint32_t> parts{};  ///< --parts, as a set of parts; nothing = tool, wrist, elbow
  bool within{false};                    ///< --within
  bool remove{false};                    ///< --remove
};

/// An option of a verb. All except --who, --parts and the switches take a number.
struct OptionSpec {
  std::string_view name;   ///< with its dashes
  std::string_view value;  ///< name of the value in the help; empty for a switch
  std::string_view help;
};

/// The grammar of one verb.
struct VerbSpec {
  Verb verb;
  std::string_view word;
  std::vector<std::string_view> arguments;  ///< names, in order
  std::size_t required;                     ///< number of arguments that must be given
  std::vector<OptionSpec> options;
  std::string_view help;
  bool motion;      ///< has a ticket, takes time, can be stopped
  bool in_program;  ///< allowed in a program
  /// Arguments and options as the help shows them; empty: usage_of() lists both one by one.
  std::string_view usage{};
};

/// All verbs, in the order of the help.
[[nodiscard]] std::span<const VerbSpec> verbs();
[[nodiscard]] const VerbSpec* find_verb(std::string_view word);
[[nodiscard]] const VerbSpec& spec_of(Verb verb);

/// Returns a note on a percentage between 0 and 1, which may be meant as a ratio, or "".
[[nodiscard]] std::string ratio_note(const Request& request);

/// Returns "; did you mean 'move'?" for a word that is not among `commands`. The word is a misspelling or the
/// name of a command elsewhere. Returns "" if no command is similar.
[[nodiscard]] std::string suggest_command(std::string_view word, std::span<const std::string_view> commands);

/// Returns "move X Y Z [--above D] [--time T]".
[[nodiscard]] std::string usage_of(const VerbSpec& spec);

/// Reads and checks the words of one command, its verb first. It checks everything that does not need the
/// robot; the servant checks ranges and reach. A string describes the fault.
[[nodiscard]] std::variant<Request, std::string> parse_request(std::span<const std::string> words);

/// Returns the request as it would stand in a program.
[[nodiscard]] std::string to_string(const Request& request);

}  // namespace corbot::client
