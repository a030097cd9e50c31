// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/cia402_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace corbot::sim {
namespace {

constexpr canid_t kSync = 0x080;
constexpr canid_t kTpdo1 = 0x180;

/// A hexadecimal number, with or without 0x.
std::optional<std::uint32_t> code_of(std::string_view text) {
  if (text.starts_with("0x")) text.remove_prefix(2);
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

Cia402Server::Cia402Server(const Cia402ServerOptions& options)
    : name_(options.bus),
      bus_(make_can_bus(options.bus)),
      record_(open_record(options.record, "time_ns,node,target,position")) {
  for (int node = 1; node <= options.nodes; ++node) {
    slots_.push_back({Cia402Node(static_cast<std::uint8_t>(node), options.drive)});
  }
}

void Cia402Server::run() {
  plug();
  for (;;) {
    (void)std::fflush(stdout);
    advance();
    std::vector<pollfd> fds{{ending_.fd(), POLLIN, 0}, {control_.fd(), POLLIN, 0}};
    bus_->add_to(fds);
    timespec left{};
    const auto event_ns = next_event_ns();
    if (event_ns) {
      const std::int64_t left_ns = std::max<std::int64_t>(*event_ns - clock_ns(), 0);
      left = {left_ns / 1'000'000'000, left_ns % 1'000'000'000};
    }
    if (::ppoll(fds.data(), fds.size(), event_ns ? &left : nullptr, nullptr) <= 0) continue;
    if (fds[0].revents != 0) break;
    read_bus();
    if (fds[1].revents != 0) control_.read([this](std::string_view command) { return handle(command); });
  }
}

std::optional<std::int64_t> Cia402Server::next_event_ns() const {
  std::optional<std::int64_t> next;
  for (const Slot& slot : slots_) {
    const auto event_ns = slot.node.next_event_ns();
    if (event_ns) next = std::min(next.value_or(*event_ns), *event_ns);
  }
  return next;
}

void Cia402Server::advance() {
  const std::int64_t now_ns = clock_ns();
  for (Slot& slot : slots_) {
    slot.node.advance(now_ns);
    flush(slot);
  }
}

void Cia402Server::flush(Slot& slot) {
  for (can_frame& frame : slot.node.take_sent()) {
    if (slot.is_silent || (slot.is_mute && (frame.can_id & ~canid_t{0x7F}) == kTpdo1)) continue;
    if (to_garble_ > 0) {
      --to_garble_;
      for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(~byte);
    }
    bus_->send(frame);
  }
}

void Cia402Server::read_bus() {
  for (const can_frame& frame : bus_->read()) {
    if (to_drop_ > 0) {
      --to_drop_;
      continue;
    }
    const std::int64_t now_ns = clock_ns();
    for (Slot& slot : slots_) {
      slot.node.receive(frame, now_ns);
      flush(slot);
    }
    if (frame.can_id == kSync) record_sync();
  }
  if (record_ != nullptr) (void)std::fflush(record_.get());
}

void Cia402Server::record_sync() {
  if (record_ == nullptr) return;
  const std::int64_t now_ns = clock_ns();
  for (Slot& slot : slots_) {
    const std::int32_t target = slot.node.drive().target();
    const std::int32_t position = slot.node.drive().position();
    if (target == slot.recorded_target && position == slot.recorded_position) continue;
    fmt::print(record_.get(), "{},{},{},{}\n", now_ns, slot.node.node(), target, position);
    slot.recorded_target = target;
    slot.recorded_position = position;
  }
}

std::string Cia402Server::handle(std::string_view command) {
  const std::vector<std::string_view> words = words_of(command);
  if (words.size() == 1 && (words[0] == "positions" || words[0] == "targets")) {
    advance();
    std::string text(words[0]);
    for (const Slot& slot : slots_) {
      const Cia402Drive& drive = slot.node.drive();
      text +=
          fmt::format(" {}={}", slot.node.node(), words[0] == "targets" ? drive.target() : drive.position());
    }
    return text;
  }
  const std::string error = execute(words);
  return error.empty() ? fmt::format("ok {}", fmt::join(words, " ")) : "error: " + error;
}

std::string Cia402Server::execute(const std::vector<std::string_view>& words) {
  const std::string_view what = words[0];
  const auto counted = words.size() == 2 ? count_of(words[1]) : std::nullopt;
  const std::uint64_t count = counted.value_or(0);
  if (what == "drop" && counted) {
    to_drop_ = count;
  } else if (what == "garble" && counted) {
    to_garble_ = count;
  } else if (what == "unplug" && words.size() == 1) {
    bus_->close();
  } else if (what == "plug" && words.size() == 1) {
    if (bus_->is_open()) return "it is plugged in";
    try {
      plug();
    } catch (const std::runtime_error& e) {
      return e.what();
    }
  } else if (!execute_on_nodes(words)) {
    return fmt::format(
        "'{}' is none of: emcy CODE [NODE], silent on|off [NODE], mute on|off [NODE], sto on|off [NODE], "
        "reset [NODE] [lost], abort CODE [NODE], drop N, garble N, unplug, plug, positions, targets",
        fmt::join(words, " "));
  }
  return {};
}

bool Cia402Server::execute_on_nodes(std::vector<std::string_view> words) {
  const std::string_view what = words[0];
  const bool loses_count = what == "reset" && words.back() == "lost";
  if (loses_count) words.pop_back();
  const std::size_t arguments = what == "reset" ? 0 : 1;
  if (words.size() < 1 + arguments || words.size() > 2 + arguments) return false;
  const std::string_view how = arguments > 0 ? words[1] : std::string_view();
  const auto code = code_of(how);
  const bool is_switch = how == "on" || how == "off";
  const bool is_known = what == "reset" ||
                        ((what == "silent" || what == "mute" || what == "sto") && is_switch) ||
                        (what == "emcy" && code && *code <= 0xFFFF) || (what == "abort" && code);
  if (!is_known) return false;
  std::uint64_t only = 0;
  if (words.size() == 2 + arguments) {
    only = count_of(words[1 + arguments]).value_or(0);
    if (only < 1 || only > slots_.size()) return false;
  }
  const std::int64_t now_ns = clock_ns();
  for (Slot& slot : slots_) {
    if (only != 0 && slot.node.node() != only) continue;
    if (what == "silent") {
      slot.is_silent = how == "on";
    } else if (what == "mute") {
      slot.is_mute = how == "on";
    } else if (what == "sto") {
      slot.node.set_sto(how == "on", now_ns);
    } else if (what == "reset") {
      slot.node.power_cycle(now_ns, loses_count);
    } else if (what == "emcy") {
      slot.node.emergency(static_cast<std::uint16_t>(*code), now_ns);
    } else {
      slot.node.abort_next(*code);
    }
    flush(slot);
  }
  return true;
}

void Cia402Server::plug() {
  bus_->open();
  print_line("ready " + name_);
}

}  // namespace corbot::sim
