// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

// The commands for the robot: the same on the command line and in a program.

namespace corbot::client {

enum class Verb {
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
  kMoveRelative,  // motions
  kSpeed,
  kPitch,
  kLimit,
  kOrientation,
  kTool,
  kBase,
  kFrames,
  kOverride,  // settings
  kStop,
  kCancel,
  kPause,
  kResume,
  kHold,
  kClear,
  kAcquire,
  kRenew,
  kRelease,  // at once; not in programs
};

/// A checked command. Units of the CORBA interface: metres, degrees, seconds, percent.
struct Request {
  Verb verb{};
  std::vector<double> numbers;       ///< the positional arguments in order
  double above_m{0};                 ///< --above
  double time_s{0};                  ///< --time; 0 = as fast as the limits allow
  int joint{-1};                     ///< --joint; −1 = none
  std::string joint_name{};          ///< in place of the number of the joint; empty: none
  bool all{false};                   ///< --all
  bool force{false};                 ///< --force
  bool reset{false};                 ///< --reset
  bool line{false};                  ///< --line
  bool tool{false};                  ///< --tool
  double lease_s{60};                ///< --lease
  std::optional<std::string> who{};  ///< --who; nothing = user and machine
};

/// An option of a verb; all but --who and the switches take a number.
struct OptionSpec {
  std::string_view name;   ///< with its dashes
  std::string_view value;  ///< what help calls the value; empty for a switch
  std::string_view help;
};

/// The grammar of one verb.
struct VerbSpec {
  Verb verb;
  std::string_view word;
  std::vector<std::string_view> arguments;  ///< names, in order
  std::size_t required;                     ///< how many of them must be there
  std::vector<OptionSpec> options;
  std::string_view help;
  bool motion;      ///< has a ticket, takes time, can be stopped
  bool in_program;  ///< allowed in a program
};

/// All verbs, in the order of the help.
[[nodiscard]] std::span<const VerbSpec> verbs();
[[nodiscard]] const VerbSpec* find_verb(std::string_view word);
[[nodiscard]] const VerbSpec& spec_of(Verb verb);

/// A note on a percentage between 0 and 1, which may be meant as a ratio; or nothing.
[[nodiscard]] std::string ratio_note(const Request& request);

/// "; did you mean 'move'?": for a word that is none of `commands`. It is misspelt, or other programs call a command
/// so. Empty: nothing is near.
[[nodiscard]] std::string suggest_command(std::string_view word, std::span<const std::string_view> commands);

/// "move X Y Z [--above D] [--time T]"
[[nodiscard]] std::string usage_of(const VerbSpec& spec);

/// Reads and checks the words of one command, its verb first. Everything that can be known without the robot
/// is checked here; ranges and reach are the servant's business. A string describes the fault.
[[nodiscard]] std::variant<Request, std::string> parse_request(std::span<const std::string> words);

/// The request as a program would write it.
[[nodiscard]] std::string to_string(const Request& request);

}  // namespace corbot::client
