// SPDX-License-Identifier: Apache-2.0
#include "soak/device_rig.h"

#include <fmt/format.h>
#include <signal.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "soak/stall_watch.h"

namespace corbot::soak {
namespace {

constexpr double kUp_s = 30.0;
constexpr std::int64_t kLook_ns = 100'000'000;
constexpr std::int64_t kLate_ns =
    20'000'000;  // of which a deadline of 100 ms takes notice, with two processes more

}  // namespace

const char* to_string(DeviceKind kind) {
  switch (kind) {
    case DeviceKind::kSsc32:
      return "ssc32";
    case DeviceKind::kMaestro:
      return "maestro";
    case DeviceKind::kCia402:
      return "cia402";
  }
  return "";
}

DeviceRig::DeviceRig(DeviceKind kind, std::string program, std::string scratch, const std::string& profile)
    : kind_(kind),
      program_(std::move(program)),
      scratch_(std::move(scratch)),
      profile_(fmt::format("{}/{}.toml", scratch_, to_string(kind))) {
  std::ifstream from(profile);
  const std::string all{std::istreambuf_iterator<char>{from}, {}};
  const std::size_t end = all.find("[backend]");
  if (end == std::string::npos) throw std::runtime_error(profile + " has no [backend]");
  std::ofstream(profile_) << all.substr(0, end) << backend();
}

std::string DeviceRig::backend() const {
  if (kind_ == DeviceKind::kSsc32)  // a contact that opens when it is pressed
    return fmt::format(
        "[backend]\nkind = \"ssc32\"\n[backend.ssc32]\nport = \"{}/tty\"\nreadback = true\nstop_input = "
        "\"A\"\n"
        "stop_active = \"high\"\n",
        scratch_);
  if (kind_ == DeviceKind::kMaestro)
    return fmt::format(
        "[backend]\nkind = \"maestro\"\n[backend.maestro]\nport = \"{}/tty\"\nmulti_target = true\nreadback "
        "= true\n",
        scratch_);
  std::string text = fmt::format(
      "[backend]\nkind = \"socketcan\"\n[backend.socketcan]\ninterface = \"unix:{}/can\"\nheartbeat_ms = "
      "100\n"
      "watch_ms = 300\nreadback = true\nat_end = \"hold\"\n",
      scratch_);
  for (int node = 1; node <= 4; ++node)
    text += fmt::format(
        "[[backend.socketcan.drive]]\nnode = {}\ncounts_per_degree = 1000.0\nzero_count = 0\ndirection = 1\n",
        node);
  return text + "[backend.socketcan.gripper]\nnode = 5\nclosed_count = 0\nopen_count = 40000\n";
}

std::vector<std::string> DeviceRig::words() const {
  std::vector<std::string> words{program_, to_string(kind_)};
  if (kind_ == DeviceKind::kCia402)
    words.insert(words.end(), {"--can", "unix:" + scratch_ + "/can", "--nodes", "5"});
  else
    words.insert(words.end(), {"--pty", scratch_ + "/tty"});
  words.insert(words.end(), {"--record", lives_.back().record});
  return words;
}

void DeviceRig::start() {
  read_ = 0;
  lives_.push_back({now_ns(), 0, fmt::format("{}/device-{}.csv", scratch_, lives_.size())});
  process_ = std::make_unique<test::Process>(words());
  if (!process_->wait_line("ready", test::within(kUp_s)))
    throw std::runtime_error(fmt::format("corbot-sim does not come up: {}", process_->errors()));
  if (kind_ == DeviceKind::kSsc32) command("input A 0");  // nobody presses
}

void DeviceRig::kill() {
  if (!process_) return;
  process_->signal(SIGKILL);
  (void)process_->wait(test::within(kUp_s));
  lives_.back().end_ns = now_ns();
  process_.reset();
}

void DeviceRig::freeze(bool is_frozen) {
  if (process_) process_->signal(is_frozen ? SIGSTOP : SIGCONT);
}

void DeviceRig::command(const std::string& line) {
  if (process_) process_->send(line);
}

void DeviceRig::look() {
  const std::int64_t time_ns = now_ns();
  if (!process_ || kind_ == DeviceKind::kCia402 || time_ns - looked_ns_ < kLook_ns) return;
  const std::string& text = process_->output();
  for (std::size_t end = text.find('\n', read_); end != std::string::npos; end = text.find('\n', read_)) {
    const std::string line = text.substr(read_, end - read_);
    read_ = end + 1;
    if (!line.starts_with("late ")) continue;
    const std::int64_t late_ns = std::strtoll(line.c_str() + 5, nullptr, 10);
    if (late_ns > kLate_ns) late_.push_back({looked_ns_ - kLook_ns - late_ns, time_ns});
  }
  looked_ns_ = time_ns;
  command("late");
}

int DeviceRig::stop() {
  const int code = process_ ? process_->terminate() : 0;
  process_.reset();
  return code;
}

DeviceLog DeviceRig::log(const ArmModel& arm) const {
  DeviceLog log(kind_ == DeviceKind::kCia402 ? DeviceLog::Kind::kCounts : DeviceLog::Kind::kPulses, arm);
  for (const Life& life : lives_) {
    log.begin_life(life.begin_ns);
    std::ifstream stream(life.record);
    for (std::string line; std::getline(stream, line) && !stream.eof();) log.read(line);
    if (life.end_ns != 0) log.end_life(life.end_ns);
  }
  return log;
}

}  // namespace corbot::soak
