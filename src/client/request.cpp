// SPDX-License-Identifier: Apache-2.0
#include "client/request.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>

#include "client/number.h"
#include "config/similar.h"
#include "corbot/channel/control_bounds.h"
#include "corbot/kinematics/arm_parts.h"

namespace corbot::client {

namespace {

// 2^53: above it a double cannot represent all integers
constexpr double kLargestTicket = 9007199254740992.0;

const OptionSpec kTime{"--time", "T",
                       "Seconds that the motion takes; 0 or none: as fast as the limits allow"};
const OptionSpec kLine{"--line", "", "Move in a straight line, and turn in step with it"};
const OptionSpec kAbove{"--above", "D", "Go to D metres above the point, vertically"};

static_assert(kShortestLease_s == 0.5 && kLongestLease_s == 3600.0, "the help of --lease names both");

const std::vector<VerbSpec> kVerbs{
    {Verb::kMove,
     "move",
     {"X", "Y", "Z"},
     3,
     {kAbove, kTime},
     "Move freely (all joints start and end together) to a point, metres",
     true,
     true},
    {Verb::kMoveS,
     "moves",
     {"X", "Y", "Z"},
     3,
     {kAbove, kTime},
     "Move in a straight line to a point, metres",
     true,
     true},
    {Verb::kMoveC,
     "movec",
     {"X1", "Y1", "Z1", "X2", "Y2", "Z2", "X3", "Y3", "Z3"},
     9,
     {},
     "Move along the arc from P1 through P2 to P3, metres",
     true,
     true},
    {Verb::kMovePose,
     "movepose",
     {"X", "Y", "Z", "A|QW", "B|QX", "C|QY", "QZ"},
     6,
     {kLine, kTime},
     "Move to a pose: a point, metres, and angles as status shows them, degrees, or a quaternion",
     true,
     true,
     "X Y Z (A B C | QW QX QY QZ) [--line] [--time T]"},
    {Verb::kMoveRelative,
     "moverelative",
     {"DX", "DY", "DZ", "A|QW", "B|QX", "C|QY", "QZ"},
     3,
     {{"--tool", "", "Move along the tool's axes instead of the base's"}, kLine, kTime},
     "Move by an offset, metres, and by a turn, as for movepose; without a turn the orientation stays",
     true,
     true,
     "DX DY DZ [A B C | QW QX QY QZ] [--tool] [--line] [--time T]"},
    {Verb::kDrive,
     "drive",
     {"JOINT", "INCREMENT", "SPEED"},
     3,
     {},
     "Move one joint (its number, from 0, or name) by degrees at degrees a second; a sliding joint by metres",
     true,
     true},
    {Verb::kJoints,
     "joints",
     {"A0", "A1", "A2", "A3", "A4", "A5"},
     1,
     {kTime},
     "Move to the given joint values, one for each joint: degrees, or metres of a sliding joint",
     true,
     true,
     "A0 A1 ... [--time T]"},
    {Verb::kReady, "ready", {}, 0, {}, "Move all joints to zero", true, true},
    {Verb::kDelay, "delay", {"SECONDS"}, 1, {}, "Wait at rest for a time", true, true},
    {Verb::kOpen, "open", {}, 0, {}, "Open the gripper", true, true},
    {Verb::kClose, "close", {}, 0, {}, "Close the gripper", true, true},
    {Verb::kGripper, "gripper", {"PERCENT"}, 1, {}, "Move the gripper: 0 closed, 100 open", true, true},
    {Verb::kSpeed,
     "speed",
     {"PERCENT"},
     0,
     {{"--joint", "N", "Set the second speed of joint N only: its number, from 0, or its name"},
      {"--all", "", "Set the second speed of all joints"}},
     "Set the speed of the motions that follow, or a second speed of joints; without PERCENT show both",
     false,
     true,
     "[PERCENT] [--joint N | --all]"},
    {Verb::kPitch,
     "pitch",
     {"DEGREES"},
     1,
     {},
     "Set the tool pitch for the motions that follow; 'orientation --reset' takes it back",
     false,
     true},
    {Verb::kOrientation,
     "orientation",
     {"A|QW", "B|QX", "C|QY", "QZ"},
     0,
     {{"--reset", "",
       "Take tool pitch and orientation back: each motion keeps the orientation that the tool has"}},
     "Set the tool's orientation for move, moves and movec, angles in degrees or a quaternion",
     false,
     true,
     "(A B C | QW QX QY QZ | --reset)"},
    {Verb::kLimit,
     "limit",
     {"JOINT", "LOWER", "UPPER"},
     0,
     {{"--reset", "", "Set all joints to the profile's ranges again"}},
     "Set the soft limits of one joint (its number, from 0, or name), in degrees, or metres of a sliding "
     "joint",
     false,
     true,
     "(JOINT LOWER UPPER | --reset)"},
    {Verb::kTool,
     "tool",
     {"X", "Y", "Z", "QW", "QX", "QY", "QZ"},
     3,
     {},
     "Set the tool frame, flange to tool centre point, for the motions that follow",
     false,
     true,
     "X Y Z [QW QX QY QZ]"},
    {Verb::kBase,
     "base",
     {"X", "Y", "Z", "QW", "QX", "QY", "QZ"},
     3,
     {},
     "Set the base frame, where the arm stands in the world, for the motions that follow",
     false,
     true,
     "X Y Z [QW QX QY QZ]"},
    {Verb::kFrames,
     "frames",
     {},
     0,
     {{"--reset", "", "Set both frames to the profile's again"}},
     "Show tool and base frame",
     false,
     true},
    {Verb::kWorkspace,
     "workspace",
     {"NAME", "NX|X1", "NY|Y1", "NZ|Z1", "OFFSET|X2", "Y2", "Z2"},
     0,
     {{"--within", "", "Keep the parts within the box; without this they keep out of it"},
      {"--parts", "PARTS", "Parts that keep to it, of tool, wrist, elbow and links (tool,wrist,elbow)"},
      {"--remove", "", "Remove the plane or box NAME that a client has set"},
      {"--reset", "", "Remove all planes and boxes that clients have set"}},
     "Show the planes and boxes to which motions keep, or set one, metres: a plane's normal points to where "
     "the arm stays",
     false,
     false,
     "[NAME (NX NY NZ OFFSET | X1 Y1 Z1 X2 Y2 Z2 [--within]) [--parts PARTS] | NAME --remove | --reset]"},
    {Verb::kOverride,
     "override",
     {"PERCENT"},
     1,
     {},
     "Set the rate of all motion, including the one under way",
     false,
     true},
    {Verb::kStop,
     "stop",
     {},
     0,
     {{"--all", "", "Stop every robot of this user on this machine"}},
     "Stop the arm now and discard what is queued",
     false,
     false},
    {Verb::kCancel,
     "cancel",
     {"TICKET"},
     1,
     {},
     "Take back one motion by its number, and what is queued behind it",
     false,
     false},
    {Verb::kPause, "pause", {}, 0, {}, "Slow down on the path and hold", false, false},
    {Verb::kResume, "resume", {}, 0, {}, "Continue after a pause", false, false},
    {Verb::kHold, "hold", {}, 0, {}, "Stop the arm now, and let nothing move until 'clear'", false, false},
    {Verb::kClear, "clear", {}, 0, {}, "Leave the Error state once its cause is gone", false, false},
    {Verb::kAcquire,
     "acquire",
     {},
     0,
     {{"--lease", "SECONDS", "Seconds after which unused control ends, 0.5 to 3600 (60)"},
      {"--who", "NAME", "Name of the holder that other clients read (USER@MACHINE)"}},
     "Take exclusive control of an arm at rest; prints the reference for --robot or $CORBOT_ROBOT",
     false,
     false},
    {Verb::kRenew,
     "renew",
     {},
     0,
     {},
     "Restart the lease; --robot or $CORBOT_ROBOT is the reference",
     false,
     false},
    {Verb::kRelease,
     "release",
     {},
     0,
     {{"--force", "", "End any client's control of a robot of yours on this machine, without the reference"}},
     "Give control back and stop the arm; --robot or $CORBOT_ROBOT is the reference",
     false,
     false},
};

std::optional<std::string> check_shape(const Request& request) {
  const std::size_t count = request.numbers.size();
  const bool is_set = request.shape && !request.remove && !request.reset;
  const bool has_options = request.within || request.parts;
  if (is_set
          ? (count == 4 && !request.within) || count == 6
          : !has_options && count == 0 && (request.remove ? request.shape && !request.reset : !request.shape))
    return std::nullopt;
  return "write NAME NX NY NZ OFFSET for a plane, NAME X1 Y1 Z1 X2 Y2 Z2 for a box, NAME --remove, --reset "
         "alone, or nothing; --within is for a box";
}

std::string parts_text(std::uint32_t parts) {
  std::string text;
  for (std::size_t part = 0; part <= kFirstLink; ++part) {
    if ((parts & bit_of(part)) == 0) continue;
    text += (text.empty() ? "" : ",") + std::string(part < kFirstLink ? kPartNames[part] : "links");
  }
  return text;
}

/// Reads names like tool,links as a set of parts.
std::optional<std::uint32_t> read_parts(std::string_view names) {
  constexpr std::uint32_t kLinks = kAllParts - (bit_of(kFirstLink) - 1);
  std::uint32_t parts = 0;
  for (std::size_t from = 0; from <= names.size();) {
    const std::size_t comma = std::min(names.find(',', from), names.size());
    const std::string_view name = names.substr(from, comma - from);
    const auto end = kPartNames.begin() + kFirstLink;
    const auto found = std::find(kPartNames.begin(), end, name);
    if (found == end && name != "links") return std::nullopt;
    parts |= found == end ? kLinks : bit_of(static_cast<std::size_t>(found - kPartNames.begin()));
    from = comma + 1;
  }
  return parts;
}

std::optional<std::string> check_control(const Request& request) {
  if (!(request.lease_s >= kShortestLease_s && request.lease_s <= kLongestLease_s))
    return fmt::format("--lease {}: must be {} to {} seconds", request.lease_s, kShortestLease_s,
                       kLongestLease_s);
  if (request.who && !is_holder_name(*request.who))
    return fmt::format("--who '{}': must be 1 to {} printable ASCII characters", *request.who,
                       kLongestHolderName);
  return std::nullopt;
}

/// Checks the rules for all robots. Returns a string that describes the fault.
std::optional<std::string> check_values(const Request& request) {
  const auto& n = request.numbers;
  if (request.time_s < 0) return fmt::format("--time {}: must not be negative", request.time_s);
  switch (request.verb) {
    case Verb::kDelay:
      if (n[0] < 0) return fmt::format("SECONDS {}: must not be negative", n[0]);
      break;
    case Verb::kLimit:
      if (n.size() != (request.reset ? 0u : 3u)) return "write either JOINT LOWER UPPER, or --reset alone";
      if (!request.reset && n[1] > n[2]) return fmt::format("LOWER {} is above UPPER {}", n[1], n[2]);
      break;
    case Verb::kMoveRelative:
      if (n.size() != 3 && n.size() < 6)
        return "write after DZ three angles A B C, a quaternion QW QX QY QZ, or nothing";
      break;
    case Verb::kOrientation:
      if (request.reset ? !n.empty() : n.size() < 3)
        return "write three angles A B C, a quaternion QW QX QY QZ, or --reset alone";
      break;
    case Verb::kTool:
    case Verb::kBase:
      if (n.size() != 3 && n.size() != 7) return "write either X Y Z, or X Y Z QW QX QY QZ";
      break;
    case Verb::kGripper:
      if (!(n[0] >= 0 && n[0] <= 100)) return fmt::format("PERCENT {}: must be 0 to 100", n[0]);
      break;
    case Verb::kSpeed:
      if (n.empty() && !request.all && request.joint < 0) break;  // shows the speeds
      if (n.empty()) return "PERCENT missing";
      [[fallthrough]];
    case Verb::kOverride:
      if (!(n[0] > 0 && n[0] <= 100)) {
        return fmt::format("PERCENT {}: must be above 0 and at most 100", n[0]);
      }
      if (request.all && request.joint >= 0) return "give either --joint or --all, not both";
      break;
    case Verb::kAcquire:
      return check_control(request);
    case Verb::kWorkspace:
      return check_shape(request);
    default:
      break;
  }
  return std::nullopt;
}

/// Reads a joint of --joint, drive or limit: a number, or a name, which only the robot knows. Returns nothing
/// if it is neither.
std::optional<int> read_joint(const std::string& word, Request& request) {
  const auto joint = parse_integer(word);
  if (joint && *joint >= 0) return joint;
  if (word.empty() || std::isalpha(static_cast<unsigned char>(word[0])) == 0) return std::nullopt;
  request.joint_name = word;
  return 0;
}

constexpr const char* kJointFault = "must be a joint's number, from 0, or its name";

std::optional<std::string> read_option(const OptionSpec& option, std::span<const std::string> words,
                                       std::size_t& index, Request& request) {
  if (option.value.empty()) {
    (option.name == "--force"    ? request.force
     : option.name == "--reset"  ? request.reset
     : option.name == "--remove" ? request.remove
     : option.name == "--within" ? request.within
     : option.name == "--line"   ? request.line
     : option.name == "--tool"   ? request.tool
                                 : request.all) = true;
    return std::nullopt;
  }
  if (index + 1 >= words.size()) return fmt::format("{} needs a value", option.name);
  const std::string& word = words[++index];
  if (option.name == "--joint") {
    const auto joint = read_joint(word, request);
    if (!joint) return fmt::format("--joint {}: {}", word, kJointFault);
    request.joint = *joint;
    return std::nullopt;
  }
  if (option.name == "--who") {
    request.who = word;
    return std::nullopt;
  }
  if (option.name == "--parts") {
    request.parts = read_parts(word);
    if (!request.parts) return fmt::format("--parts {}: must be of tool, wrist, elbow and links", word);
    return std::nullopt;
  }
  const auto value = parse_number(word);
  if (!value) return fmt::format("{}: {}", option.name, number_fault(word));
  if (option.name == "--lease") {
    request.lease_s = *value;
    return std::nullopt;
  }
  (option.name == "--time" ? request.time_s : request.above_m) = *value;
  return std::nullopt;
}

std::optional<std::string> read_argument(const VerbSpec& spec, const std::string& word, Request& request) {
  const std::size_t at = request.numbers.size() + (request.shape ? 1 : 0);
  if (at == spec.arguments.size()) {
    return fmt::format("unexpected '{}'; usage: {}", word, usage_of(spec));
  }
  if ((spec.verb == Verb::kDrive || spec.verb == Verb::kLimit) && at == 0) {
    const auto joint = read_joint(word, request);
    if (!joint) return fmt::format("JOINT '{}': {}", word, kJointFault);
    request.numbers.push_back(*joint);
    return std::nullopt;
  }
  if (spec.verb == Verb::kWorkspace && at == 0) {
    request.shape = word;
    return std::nullopt;
  }
  const auto value = parse_number(word);
  if (!value && spec.verb == Verb::kGripper)
    return fmt::format("PERCENT: {}: 0 is closed, 100 open; 'open' and 'close' are commands of their own",
                       number_fault(word));
  if (!value) return fmt::format("{}: {}", spec.arguments[at], number_fault(word));
  if (spec.verb == Verb::kCancel && *value > kLargestTicket)
    return fmt::format("TICKET '{}': the largest is {:.0f}", word, kLargestTicket);
  if (spec.verb == Verb::kCancel && !(*value >= 1 && *value == std::floor(*value)))
    return fmt::format("TICKET '{}': must be a positive integer", word);
  request.numbers.push_back(*value);
  return std::nullopt;
}

/// Names of commands in other programs, and of the methods of the Python package.
constexpr std::array<std::array<std::string_view, 2>, 16> kOtherNames{{{"wait", "delay"},
                                                                       {"sleep", "delay"},
                                                                       {"goto", "move"},
                                                                       {"jog", "moverelative"},
                                                                       {"list", "status"},
                                                                       {"info", "status"},
                                                                       {"abort", "stop"},
                                                                       {"halt", "stop"},
                                                                       {"reset", "clear"},
                                                                       {"start", "up"},
                                                                       {"movej", "joints"},
                                                                       {"movel", "moves"},
                                                                       {"line", "moves"},
                                                                       {"arc", "movec"},
                                                                       {"pose", "movepose"},
                                                                       {"relative", "moverelative"}}};

}  // namespace

std::span<const VerbSpec> verbs() { return kVerbs; }

const VerbSpec* find_verb(std::string_view word) {
  const auto& specs = kVerbs;
  const auto found = std::find_if(specs.begin(), specs.end(), [&](const auto& s) { return s.word == word; });
  return found == specs.end() ? nullptr : &*found;
}

const VerbSpec& spec_of(Verb verb) {
  const auto& specs = kVerbs;
  return *std::find_if(specs.begin(), specs.end(), [&](const auto& s) { return s.verb == verb; });
}

std::string suggest_command(std::string_view word, std::span<const std::string_view> commands) {
  std::string_view near;
  for (const auto& [other, command] : kOtherNames) {
    if (other == word && std::find(commands.begin(), commands.end(), command) != commands.end())
      near = command;
  }
  if (near.empty()) near = most_similar(word, commands, kSimilarCommand);
  return near.empty() ? "" : fmt::format("; did you mean '{}'?", near);
}

std::string ratio_note(const Request& request) {
  const bool is_percentage =
      request.verb == Verb::kGripper || request.verb == Verb::kSpeed || request.verb == Verb::kOverride;
  if (!is_percentage || request.numbers.empty()) return {};
  const double given = request.numbers[0];
  if (!(given > 0 && given < 1)) return {};
  return fmt::format("note: {} is taken as {} percent; {:g} is {:g} percent", given, given, given * 100,
                     given * 100);
}

std::string usage_of(const VerbSpec& spec) {
  if (!spec.usage.empty()) return fmt::format("{} {}", spec.word, spec.usage);
  std::string text(spec.word);
  for (std::size_t i = 0; i < spec.arguments.size(); ++i) {
    text +=
        i < spec.required ? fmt::format(" {}", spec.arguments[i]) : fmt::format(" [{}]", spec.arguments[i]);
  }
  for (const auto& option : spec.options) {
    text += option.value.empty() ? fmt::format(" [{}]", option.name)
                                 : fmt::format(" [{} {}]", option.name, option.value);
  }
  return text;
}

std::variant<Request, std::string> parse_request(std::span<const std::string> words) {
  if (words.empty()) return std::string("no command");
  const VerbSpec* spec = find_verb(words[0]);
  if (spec == nullptr) {
    std::vector<std::string_view> known;
    for (const auto& verb : kVerbs) known.push_back(verb.word);
    return fmt::format("unknown command '{}'{}", words[0], suggest_command(words[0], known));
  }
  Request request;
  request.verb = spec->verb;
  for (std::size_t i = 1; i < words.size(); ++i) {
    std::optional<std::string> fault;
    if (words[i].starts_with("--")) {
      const auto option = std::find_if(spec->options.begin(), spec->options.end(),
                                       [&](const auto& o) { return o.name == words[i]; });
      if (option == spec->options.end()) {
        std::vector<std::string_view> names;
        for (const OptionSpec& known : spec->options) names.push_back(known.name);
        const std::string_view near = most_similar(words[i], names, kSimilarCommand);
        return fmt::format("'{}' has no option '{}'{}; usage: {}", spec->word, words[i],
                           near.empty() ? "" : fmt::format(": did you mean '{}'?", near), usage_of(*spec));
      }
      fault = read_option(*option, words, i, request);
    } else {
      fault = read_argument(*spec, words[i], request);
    }
    if (fault) return *fault;
  }
  if (request.numbers.size() < spec->required) {
    return fmt::format("{} missing; usage: {}", spec->arguments[request.numbers.size()], usage_of(*spec));
  }
  if (auto fault = check_values(request)) return *fault;
  return request;
}

std::string to_string(const Request& request) {
  std::string text(spec_of(request.verb).word);
  const bool is_named = !request.joint_name.empty();
  if (request.shape) text += " " + *request.shape;
  for (std::size_t i = 0; i < request.numbers.size(); ++i) {
    const bool is_joint = i == 0 && is_named && request.joint < 0;
    text += is_joint ? " " + request.joint_name : fmt::format(" {}", request.numbers[i]);
  }
  if (request.above_m != 0) text += fmt::format(" --above {}", request.above_m);
  if (request.time_s != 0) text += fmt::format(" --time {}", request.time_s);
  if (request.joint >= 0)
    text += " --joint " + (is_named ? request.joint_name : std::to_string(request.joint));
  if (request.all) text += " --all";
  if (request.force) text += " --force";
  if (request.reset) text += " --reset";
  if (request.line) text += " --line";
  if (request.tool) text += " --tool";
  if (request.within) text += " --within";
  if (request.remove) text += " --remove";
  if (request.parts) text += " --parts " + parts_text(*request.parts);
  if (request.verb == Verb::kAcquire) text += fmt::format(" --lease {}", request.lease_s);
  if (request.who) text += fmt::format(" --who '{}'", *request.who);
  return text;
}

}  // namespace corbot::client
