// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/cia402_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace corbot::sim {
namespace {

constexpr canid_t kSync = 0x080;
constexpr canid_t kTpdo1 = 0x180;
constexpr std::int64_t kLook_ns = 5'000'000;

}  // namespace

Cia402Server::Cia402Server(const Cia402ServerOptions& options)
    : name_(options.bus),
      bus_(make_can_bus(options.bus)),
      record_(open_record(options.record, "time_ns,node,target,position,power")) {
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
  for (const ServedNode& slot : slots_) {
    const auto event_ns = slot.node.next_event_ns();
    if (event_ns) next = std::min(next.value_or(*event_ns), *event_ns);
  }
  if (record_ != nullptr) {  // a shaft that comes to rest on its own
    const std::int64_t look_ns = clock_ns() + kLook_ns;
    next = std::min(next.value_or(look_ns), look_ns);
  }
  return next;
}

void Cia402Server::advance() {
  const std::int64_t now_ns = clock_ns();
  for (ServedNode& slot : slots_) {
    slot.node.advance(now_ns);
    flush(slot);
  }
  record_changes();
}

void Cia402Server::flush(ServedNode& slot) {
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
    for (ServedNode& slot : slots_) {
      slot.node.receive(frame, now_ns);
      flush(slot);
    }
    if (frame.can_id == kSync) record_changes();
  }
  if (record_ != nullptr) (void)std::fflush(record_.get());
}

void Cia402Server::record_changes() {
  if (record_ == nullptr) return;
  const std::int64_t now_ns = clock_ns();
  for (ServedNode& slot : slots_) {
    const std::int32_t target = slot.node.drive().target();
    const std::int32_t position = slot.node.drive().position();
    const bool has_power = slot.node.drive().has_power();
    if (target == slot.recorded_target && position == slot.recorded_position &&
        has_power == slot.recorded_power)
      continue;
    fmt::print(record_.get(), "{},{},{},{},{:d}\n", now_ns, slot.node.node(), target, position, has_power);
    slot.recorded_target = target;
    slot.recorded_position = position;
    slot.recorded_power = has_power;
  }
}

std::string Cia402Server::values_of(std::string_view question) {
  if (question != "positions" && question != "targets" && question != "states") return "";
  advance();
  std::string text(question);
  for (const ServedNode& slot : slots_) {
    const Cia402Drive& drive = slot.node.drive();
    const int value = question == "targets"  ? drive.target()
                      : question == "states" ? slot.node.nmt_state()
                                             : drive.position();
    text += fmt::format(" {}={}", slot.node.node(), value);
  }
  return text;
}

std::string Cia402Server::handle(std::string_view command) {
  const std::vector<std::string_view> words = words_of(command);
  if (std::string values = words.size() == 1 ? values_of(words[0]) : ""; !values.empty()) return values;
  if (words.size() == 1 && words[0] == "help") return explain_node_commands() + "ok help";
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
  } else {
    std::string error = execute_on_nodes(slots_, words, clock_ns());
    for (ServedNode& slot : slots_) flush(slot);
    if (error.find("is none of") == std::string::npos) return error;
    return error + ", drop N, garble N, unplug, plug, positions, targets, states, help";
  }
  return {};
}

void Cia402Server::plug() {
  bus_->open();
  print_line("ready " + name_);
}

}  // namespace corbot::sim
