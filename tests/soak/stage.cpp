// SPDX-License-Identifier: Apache-2.0
#include "soak/stage.h"

#include <fmt/format.h>
#include <signal.h>
#include <time.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "support/ports.h"

namespace corbot::soak {
namespace {

namespace fs = std::filesystem;
using test::within;

constexpr double kMinute_s = 60.0;

void pause() {
  const timespec time{0, 20'000'000};
  ::nanosleep(&time, nullptr);
}

/// The active alarms that wait for a Clear. That the task is gone, or does not respond, passes by itself.
std::string lasting_cause(const nlohmann::json& status) {
  std::string cause;
  for (const auto& alarm : status.value("active_alarms", nlohmann::json::array())) {
    const std::string text = alarm.is_string() ? alarm.get<std::string>() : "";
    if (text.empty() || text.starts_with("150 ") || text.starts_with("153 ")) continue;
    cause += (cause.empty() ? "" : "; ") + text;
  }
  return cause;
}

}  // namespace

Stage::Stage(StageOptions options, const Profile& profile, std::uint64_t seed)
    : options_(std::move(options)),
      name_(test::unique_name("soak")),
      port_(test::free_port()),
      proxy_(port_),
      seed_(seed),
      recording_(profile) {}

Stage::~Stage() = default;

std::vector<std::string> Stage::environment() const {
  return {"XDG_RUNTIME_DIR=" + options_.scratch, "CORBOT_STATE_DIR=" + options_.scratch + "/state",
          "CORBOT_ROBOT="};
}

test::RunResult Stage::corbot(const std::vector<std::string>& arguments, double seconds) const {
  std::vector<std::string> words{options_.binaries + "/corbot"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return test::run(words, seconds, environment());
}

pid_t Stage::pid_of(const char* key) const {
  std::ifstream stream(fs::path(options_.scratch) / "corbot" / (name_ + ".json"));
  const auto state = nlohmann::json::parse(stream, nullptr, false);
  return state.is_object() ? state.value(key, 0) : 0;
}

pid_t Stage::client(std::size_t index) const {
  return std::next(clients_.begin(), static_cast<std::ptrdiff_t>(index))->process.pid();
}

void Stage::start_supervisor() {
  const auto deadline = within(kMinute_s);
  for (;;) {  // what the last one left may take a moment to end
    up_ = std::make_unique<test::Process>(
        std::vector<std::string>{options_.binaries + "/corbot", "up", options_.profile, "--name", name_,
                                 "--endpoint", fmt::format("127.0.0.1:{}", port_), "--orb", options_.orb},
        environment());
    if (up_->wait_line(name_ + " is up", within(kMinute_s))) return;
    if (test::Deadline::clock::now() > deadline)
      throw std::runtime_error(fmt::format("corbot up does not come up: {}", up_->errors()));
    pause();
  }
}

void Stage::start_recorder() {
  recorded_ = 0;
  const auto deadline = within(kMinute_s);
  for (;;) {  // a task that has just been killed is not there yet
    recorder_ = std::make_unique<test::Process>(
        std::vector<std::string>{options_.binaries + "/corbot", "record", "-", "--robot", name_},
        environment());
    if (recorder_->wait_line("cycle,", within(5.0))) return;
    if (test::Deadline::clock::now() > deadline)
      throw std::runtime_error(fmt::format("corbot record does not start: {}", recorder_->errors()));
  }
}

void Stage::add_client() {
  const int number = next_client_++;
  const bool watches = clients_.empty();
  const int port = number % 2 == 0 ? port_ : proxy_.port();
  clients_.push_back(
      {number,
       test::Process({options_.client, fmt::format("corbaloc::1.2@127.0.0.1:{}/{}", port, name_),
                      std::to_string(number),
                      watches ? "watch" : std::to_string(seed_ + static_cast<std::uint64_t>(number))}),
       0});
}

void Stage::drop_last_client() { clients_.pop_back(); }

void Stage::mend() {
  if (up_ && !up_->running()) abandon();
  if (!up_) {
    start_supervisor();
    start_recorder();
  } else if (!recorder_ || !recorder_->running()) {
    observe();
    start_recorder();
  }
  clients_.remove_if([&](Client& client) {
    if (client.process.running()) return false;
    read_lines(client.process, client.read, client.number);
    return true;
  });
  while (clients_.size() < static_cast<std::size_t>(options_.clients)) add_client();
}

void Stage::abandon() {
  observe();
  for (Client& client : clients_) client.process.signal(SIGKILL);
  observe();
  clients_.clear();
  if (recorder_) {
    recorder_->terminate();
    observe();
    recorder_.reset();
  }
  up_.reset();
}

void Stage::read_lines(test::Process& process, std::size_t& read, int client) {
  const std::string& text = process.output();
  for (std::size_t end = text.find('\n', read); end != std::string::npos; end = text.find('\n', read)) {
    const std::string line = text.substr(read, end - read);
    read = end + 1;
    if (client == 0) {
      recording_.read(line);
    } else {
      ledger_.read(client, line);
    }
  }
}

void Stage::observe() {
  if (recorder_) read_lines(*recorder_, recorded_, 0);
  for (Client& client : clients_) read_lines(client.process, client.read, client.number);
}

bool Stage::recover() {
  const auto deadline = within(kMinute_s);
  while (test::Deadline::clock::now() < deadline) {
    mend();
    observe();
    const test::RunResult result = corbot({"status", "--json", "--robot", name_, "--timeout", "2"});
    const auto status = nlohmann::json::parse(result.output, nullptr, false);
    const std::string state = status.is_object() ? status.value("state", "") : "";
    if (state == "Standby" || state == "Waiting") return true;
    if (state == "Error") {
      const std::string cause = lasting_cause(status);
      timespec now{};
      clock_gettime(CLOCK_MONOTONIC, &now);
      if (!cause.empty() && corbot({"clear", "--robot", name_}).code == 0)
        clears_.push_back({std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec, cause});
    }
    pause();
  }
  return false;
}

bool Stage::quiesce() {
  // A client that is frozen between two calls begins no other; one whose call is under way is let go on until it ends.
  const auto deadline = within(kMinute_s);
  bool waiting = true;
  while (waiting && test::Deadline::clock::now() < deadline) {
    waiting = false;
    for (Client& client : clients_) {
      client.process.signal(SIGSTOP);
      read_lines(client.process, client.read, client.number);
      if (!ledger_.waiting_since(client.number)) continue;
      client.process.signal(SIGCONT);
      waiting = true;
    }
    observe();
    pause();
  }
  return !waiting;
}

std::vector<std::string> Stage::open_tickets() {
  const auto ask = [&] {
    std::vector<std::string> words{options_.client,
                                   fmt::format("corbaloc::1.2@127.0.0.1:{}/{}", port_, name_), "tickets"};
    for (const Call& call : ledger_.calls()) {
      if (call.accepted() && call.ticket != 0) words.push_back(std::to_string(call.ticket));
    }
    std::istringstream lines(test::run(words, kMinute_s, environment()).output);
    std::vector<std::string> open;
    for (std::string line; std::getline(lines, line);) {
      if (line.ends_with("queued") || line.ends_with("running")) open.push_back(line);
    }
    return open;
  };
  std::vector<std::string> open;
  (void)test::wait_until(within(kMinute_s), [&] { return (open = ask()).empty(); });
  return open;
}

std::string Stage::take_down() {
  for (Client& client : clients_) client.process.signal(SIGKILL);
  observe();
  clients_.clear();
  std::string left;
  if (const int code = up_ ? up_->terminate() : 0; code != 0)
    left += fmt::format("corbot up ended with code {}: {}\n", code, up_->errors());
  if (recorder_) {
    recorder_->terminate();
    observe();
  }
  if (test::channel_exists(name_, options_.scratch)) left += fmt::format("a socket of {}\n", name_);
  const fs::path states = fs::path(options_.scratch) / "corbot";
  if (fs::exists(states) && !fs::is_empty(states)) {
    for (const auto& entry : fs::directory_iterator(states)) left += entry.path().string() + "\n";
  }
  return left;
}

}  // namespace corbot::soak
