// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/node_commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <span>

#include "sim/devices/control_input.h"

namespace corbot::sim {
namespace {

using Arguments = std::span<const std::string_view>;

/// The target of a command. An action returns false with `why` if it cannot be carried out.
struct Target {
  ServedNode& served;
  std::int64_t now_ns;
  std::string& why;

  [[nodiscard]] Cia402Node& node() const { return served.node; }
};

/// An action returns false if the arguments are not those of the command.
using Action = bool (*)(const Arguments& arguments, const Target* target);

struct Command {
  std::string_view word;
  std::string_view arguments;
  std::string_view help;
  std::size_t fewest;  ///< arguments, without the node
  std::size_t most;
  Action act;  ///< without a target it only checks
};

/// Parses a hexadecimal number, with or without 0x.
std::optional<std::uint32_t> code_of(std::string_view text) {
  if (text.starts_with("0x")) text.remove_prefix(2);
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::int32_t> counts_of(std::string_view text) {
  std::int32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parses "60C2", which means all sub-indices, or "60C2:1".
std::optional<ObjectPattern> object_of(std::string_view text) {
  constexpr std::size_t kDigits = 4;
  if (text.size() < kDigits) return std::nullopt;
  const auto index = code_of(text.substr(0, kDigits));
  if (!index || text.starts_with("0x")) return std::nullopt;
  ObjectPattern pattern{static_cast<std::uint16_t>(*index), {}};
  if (text.size() == kDigits) return pattern;
  const auto sub = count_of(text.substr(kDigits + 1));
  if (text[kDigits] != ':' || !sub || *sub > 0xFF) return std::nullopt;
  pattern.sub = static_cast<std::uint8_t>(*sub);
  return pattern;
}

std::optional<bool> switch_of(std::string_view text) {
  if (text != "on" && text != "off") return std::nullopt;
  return text == "on";
}

/// Calls `act` with a switch, which is the last argument.
template <class Act>
bool with_switch(const Arguments& arguments, const Target* target, const Act& act) {
  const auto is_on = switch_of(arguments.back());
  if (is_on && target != nullptr) act(*target, *is_on);
  return is_on.has_value();
}

/// Calls `act` with an object and a switch.
template <class Act>
bool with_object_switch(const Arguments& arguments, const Target* target, const Act& act) {
  const auto where = object_of(arguments[0]);
  const auto is_on = switch_of(arguments[1]);
  if (!where || !is_on) return false;
  if (target != nullptr) {
    target->node().change_rules([&](ObjectRules& rules) { act(rules, *where, *is_on); });
  }
  return true;
}

bool report(const Arguments& arguments, const Target* target) {
  const auto code = code_of(arguments[0]);
  if (!code || *code > 0xFFFF) return false;
  if (target != nullptr) target->node().emergency(static_cast<std::uint16_t>(*code), target->now_ns);
  return true;
}

bool silence(const Arguments& arguments, const Target* target) {
  return with_switch(arguments, target, [](const Target& t, bool is_on) { t.served.is_silent = is_on; });
}

bool mute(const Arguments& arguments, const Target* target) {
  return with_switch(arguments, target, [](const Target& t, bool is_on) { t.served.is_mute = is_on; });
}

bool torque_off(const Arguments& arguments, const Target* target) {
  return with_switch(arguments, target,
                     [](const Target& t, bool is_on) { t.node().set_sto(is_on, t.now_ns); });
}

bool block(const Arguments& arguments, const Target* target) {
  return with_switch(arguments, target,
                     [](const Target& t, bool is_on) { t.node().set_blocked(is_on, t.now_ns); });
}

bool place_piece(const Arguments& arguments, const Target* target) {
  const auto counts = counts_of(arguments[0]);
  if (!counts && arguments[0] != "off") return false;
  if (target != nullptr) target->node().set_piece(counts, target->now_ns);
  return true;
}

bool ignore(const Arguments& arguments, const Target* target) {
  return with_switch(arguments, target,
                     [](const Target& t, bool is_on) { t.node().set_ignoring(is_on, t.now_ns); });
}

bool disable(const Arguments&, const Target* target) {
  if (target != nullptr) target->node().leave_operation(target->now_ns);
  return true;
}

bool turn(const Arguments& arguments, const Target* target) {
  const auto counts = counts_of(arguments[0]);
  if (!counts) return false;
  if (target != nullptr && !target->node().turn(*counts, target->now_ns)) {
    target->why = fmt::format("node {} has power and holds its shaft", target->node().node());
  }
  return true;
}

bool reset(const Arguments& arguments, const Target* target) {
  const bool loses_count = !arguments.empty();
  if (loses_count && arguments[0] != "lost") return false;
  if (target != nullptr) target->node().power_cycle(target->now_ns, loses_count);
  return true;
}

bool make_incremental(const Arguments& arguments, const Target* target) {
  return with_switch(arguments, target, [](const Target& t, bool is_on) { t.node().set_incremental(is_on); });
}

bool place_switch(const Arguments& arguments, const Target* target) {
  const auto counts = counts_of(arguments[1]);
  const bool is_known = arguments[0] == "home" || arguments[0] == "negative" || arguments[0] == "positive";
  if (!counts || !is_known) return false;
  if (target == nullptr) return true;
  AxisSwitches switches = target->node().drive().switches();
  (arguments[0] == "home"       ? switches.home
   : arguments[0] == "negative" ? switches.negative
                                : switches.positive) = *counts;
  target->node().set_switches(switches);
  return true;
}

bool store(const Arguments& arguments, const Target* target) {
  const auto where = object_of(arguments[0]);
  const auto value = code_of(arguments[1]);
  if (!where || !value) return false;
  const ObjectKey key = ObjectKey{where->index} << 8 | where->sub.value_or(0);
  if (target != nullptr && !target->node().store(key, *value, target->now_ns)) {
    target->why =
        fmt::format("node {}: {} cannot hold {}", target->node().node(), arguments[0], arguments[1]);
  }
  return true;
}

bool restrict(const Arguments& arguments, const Target* target) {
  static constexpr std::array<std::pair<std::string_view, WriteWhen>, 6> kTimes{
      {{"always", WriteWhen::kAlways},
       {"never", WriteWhen::kNever},
       {"pre-operational", WriteWhen::kPreOperational},
       {"pdo-off", WriteWhen::kPdosOff},
       {"mode-0", WriteWhen::kModeInactive},
       {"disabled", WriteWhen::kDisabled}}};
  const auto where = object_of(arguments[0]);
  const auto* const time =
      std::find_if(kTimes.begin(), kTimes.end(), [&](const auto& t) { return t.first == arguments[1]; });
  if (!where || time == kTimes.end()) return false;
  if (target != nullptr) {
    target->node().change_rules([&](ObjectRules& rules) { rules.set_when(*where, time->second); });
  }
  return true;
}

bool map(const Arguments& arguments, const Target* target) {
  const std::string_view how = arguments[0];
  if (how != "wanted" && how != "other" && how != "free") return false;
  if (target == nullptr) return true;
  const WriteWhen when = how == "free" ? WriteWhen::kAlways : WriteWhen::kNever;
  const std::uint32_t entries = how == "wanted" ? 2 : 1;
  Cia402Node& node = target->node();
  node.change_rules([&](ObjectRules& rules) {
    for (const std::uint16_t mapping : {std::uint16_t{0x1600}, std::uint16_t{0x1A00}}) {
      rules.set_when({mapping, {}}, when);
      if (how == "free") continue;
      const bool is_received = mapping == 0x1600;
      rules.set_value(ObjectKey{mapping} << 8, entries);
      rules.set_value(ObjectKey{mapping} << 8 | 1, is_received ? 0x6040'0010 : 0x6041'0010);
      rules.set_value(ObjectKey{mapping} << 8 | 2, entries < 2 ? 0 : is_received ? 0x607A'0020 : 0x6064'0020);
    }
  });
  return true;
}

bool hide(const Arguments& arguments, const Target* target) {
  return with_object_switch(
      arguments, target,
      [](ObjectRules& rules, const ObjectPattern& where, bool is_on) { rules.set_missing(where, is_on); });
}

bool leave_unanswered(const Arguments& arguments, const Target* target) {
  return with_object_switch(
      arguments, target,
      [](ObjectRules& rules, const ObjectPattern& where, bool is_on) { rules.set_unanswered(where, is_on); });
}

bool abort(const Arguments& arguments, const Target* target) {
  const auto code = code_of(arguments[0]);
  const auto where = arguments.size() > 1 ? object_of(arguments[1]) : std::nullopt;
  if (!code || (arguments.size() > 1 && !where)) return false;
  if (target != nullptr) target->node().abort_next(*code, where);
  return true;
}

constexpr std::array<Command, 18> kCommands{{
    {"emcy", "CODE",
     "reports an error (hexadecimal); but for 81xx, 82xx and FFxx it stops the drive, too; 0: it has gone", 1,
     1, report},
    {"silent", "on|off", "sends nothing, though it goes on working", 1, 1, silence},
    {"mute", "on|off", "sends no process data, but its heartbeat and all else", 1, 1, mute},
    {"sto", "on|off",
     "safe torque off: leaves operation enabled, bit 4 of its statusword is 0; off: it stays disabled", 1, 1,
     torque_off},
    {"block", "on|off", "something holds the shaft", 1, 1, block},
    {"piece", "COUNTS|off",
     "the shaft gets as far as COUNTS, and no further: what a gripper closes on, or an end", 1, 1,
     place_piece},
    {"ignore", "on|off", "stays enabled, does not follow its targets, and says so (bit 12 of the statusword)",
     1, 1, ignore},
    {"disable", "", "leaves operation enabled without a command", 0, 0, disable},
    {"turn", "COUNTS", "turns the shaft by hand; refused where the motor holds it", 1, 1, turn},
    {"reset", "[lost]", "power off and on; the shaft stays, its count too, or begins at 0", 0, 1, reset},
    {"incremental", "on|off",
     "no absolute encoder: its count begins at 0 with every reset, until it is homed", 1, 1,
     make_incremental},
    {"switch", "home|negative|positive COUNTS",
     "where a switch of the axis is, as the shaft counted at the start", 2, 2, place_switch},
    {"store", "OBJECT VALUE",
     "sets an object (60C2:1) to a number (hexadecimal), as the maker's tool would, for good", 2, 2, store},
    {"writable", "OBJECT always|never|pre-operational|pdo-off|mode-0|disabled",
     "when an object (60C2, or 60C2:1) may be written; else the abort codes of CiA 301", 2, 2, restrict},
    {"mapping", "wanted|other|free", "PDOs that are mapped for good, as corbot needs them or not", 1, 1, map},
    {"missing", "OBJECT on|off", "there is no such object", 2, 2, hide},
    {"unanswered", "OBJECT on|off", "SDO requests for it get no answer", 2, 2, leave_unanswered},
    {"abort", "CODE [OBJECT]",
     "the next SDO request, or the next for this object, is aborted with this code (hexadecimal)", 1, 2,
     abort},
}};

std::string usage_of(const Command& command) {
  const std::string_view space = command.arguments.empty() ? "" : " ";
  return fmt::format("{}{}{} [NODE]", command.word, space, command.arguments);
}

}  // namespace

std::string execute_on_nodes(std::vector<ServedNode>& nodes, std::vector<std::string_view> words,
                             std::int64_t now_ns) {
  std::string wrong = fmt::format("'{}' is none of: {}", fmt::join(words, " "), list_node_commands());
  const auto* const command =
      std::find_if(kCommands.begin(), kCommands.end(), [&](const Command& c) { return c.word == words[0]; });
  if (command == kCommands.end()) return wrong;
  words.erase(words.begin());
  // A node is a number of up to three digits; no other optional last argument has this form.
  const auto fits = [&](const std::vector<std::string_view>& arguments) {
    return arguments.size() >= command->fewest && arguments.size() <= command->most &&
           command->act(arguments, nullptr);
  };
  std::uint64_t only = 0;
  if (!fits(words)) {
    // The node may also precede the last word: 'reset 1 lost'.
    for (const std::size_t from_end : {1u, 2u}) {
      if (words.size() < from_end) return wrong;
      const auto at = words.end() - static_cast<std::ptrdiff_t>(from_end);
      const std::uint64_t named = count_of(*at).value_or(0);
      std::vector<std::string_view> rest = words;
      rest.erase(rest.end() - static_cast<std::ptrdiff_t>(from_end));
      if (named >= 1 && named <= nodes.size() && fits(rest)) {
        only = named;
        words = rest;
        break;
      }
    }
    if (only == 0) return wrong;
  }
  std::string why;
  for (ServedNode& served : nodes) {
    if (only != 0 && served.node.node() != only) continue;
    const Target target{served, now_ns, why};
    (void)command->act(words, &target);
  }
  return why;
}

std::string list_node_commands() {
  std::vector<std::string> usages;
  for (const Command& command : kCommands) usages.push_back(usage_of(command));
  return fmt::format("{}", fmt::join(usages, ", "));
}

std::string explain_node_commands() {
  std::string text;
  for (const Command& command : kCommands) {
    text += fmt::format("  {}\n      {}\n", usage_of(command), command.help);
  }
  return text;
}

}  // namespace corbot::sim
