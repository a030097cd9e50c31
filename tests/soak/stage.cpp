// SPDX-License-Identifier: Apache-2.0
#include "soak/stage.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "soak/signature.h"
#include "soak/stall_watch.h"
#include "support/ports.h"

namespace corbot::soak {
namespace {

namespace fs = std::filesystem;
using test::within;

constexpr double kMinute_s = 60.0;
constexpr double kCommand_s = 20.0;

void pause() { sleep_ns(20'000'000); }

/// The active alarms that wait for a Clear. That the task is gone, or does not respond, passes by itself.
std::string lasting_cause(const nlohmann::json& status) {
  std::string cause;
  for (const auto& alarm : status.value("active_alarms", nlohmann::json::array())) {
    const std::string text = alarm.is_string() ? alarm.get<std::string>() : "";
    if (text.empty() || text.starts_with("150 ") || text.starts_with("153 ")) continue;
    cause += (cause.empty() ? "" : "\n") + text;
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
      recording_(profile) {
  if (!options_.kept.empty()) kept_.open(options_.kept);
  recording_.tell(options_.on_cycle);
}

Stage::~Stage() = default;

std::vector<std::string> Stage::environment() const {
  return {"XDG_RUNTIME_DIR=" + options_.scratch, "CORBOT_STATE_DIR=" + options_.scratch + "/state",
          "CORBOT_ROBOT="};
}

/// Goes on reading meanwhile: a recorder that cannot write loses cycles after a few seconds.
test::RunResult Stage::run(std::vector<std::string> words, double seconds) {
  test::Process process(std::move(words), environment());
  const auto deadline = within(seconds);
  while (process.running() && test::Deadline::clock::now() < deadline) {
    observe();
    sleep_ns(2'000'000);
  }
  const int status = process.wait(within(0)).value_or(-1);
  return {status >= 0 && WIFEXITED(status) ? WEXITSTATUS(status) : -1, process.output(), process.errors()};
}

test::RunResult Stage::corbot(const std::vector<std::string>& arguments) {
  std::vector<std::string> words{options_.binaries + "/corbot"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return run(std::move(words), kCommand_s);
}

pid_t Stage::pid_of(const char* key) const {
  std::ifstream stream(fs::path(options_.scratch) / "corbot" / (name_ + ".json"));
  const auto state = nlohmann::json::parse(stream, nullptr, false);
  return state.is_object() ? state.value(key, 0) : 0;
}

pid_t Stage::client(std::size_t index) const {
  return std::next(clients_.begin(), static_cast<std::ptrdiff_t>(index))->process.pid();
}

int Stage::client_number(std::size_t index) const {
  return std::next(clients_.begin(), static_cast<std::ptrdiff_t>(index))->number;
}

void Stage::start_supervisor() {
  announced_ = 0;
  life_begin_ns_ = now_ns();
  const auto deadline = within(kMinute_s);
  for (;;) {  // what the last one left may take a moment to end
    up_ = std::make_unique<test::Process>(
        std::vector<std::string>{options_.binaries + "/corbot", "up", options_.profile, "--name", name_,
                                 "--endpoint", fmt::format("127.0.0.1:{}", port_), "--orb", options_.orb},
        environment());
    keep(fmt::format("# {} corbot up", now_ns()));
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
  const int port = is_relayed(number) ? proxy_.port() : port_;
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
    if (kept_.is_open()) kept_ << client << ' ' << line << '\n';
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
  read_announcements();
  read_stops();
}

/// "real-time task (pid 7) ended: signal 9 (Killed), starting it again in 0.2 s"
void Stage::read_announcements() {
  if (!up_) return;
  const std::string& log = up_->errors();
  for (std::size_t end = log.find('\n', announced_); end != std::string::npos;
       end = log.find('\n', announced_)) {
    const std::string line = log.substr(announced_, end - announced_);
    announced_ = end + 1;
    keep(fmt::format("# {} {}", now_ns(), line));
    constexpr std::string_view kAgain = "starting it again in ";
    const std::size_t again = line.find(kAgain);
    if (again != std::string::npos && line.find("real-time task") != std::string::npos)
      restarts_.push_back({now_ns(), std::strtod(line.c_str() + again + kAgain.size(), nullptr)});
  }
}

void Stage::keep(const std::string& line) {
  if (kept_.is_open()) kept_ << line << std::endl;
}

void Stage::report(const std::string& line) {
  keep("c " + line);
  ledger_.read(kByCommand, line);
}

bool Stage::resume() {
  const int number = ++commands_;
  report(fmt::format("begin {} {} Resume 0 0", number, now_ns()));
  const bool done = corbot({"resume", "--robot", name_}).code == 0;
  report(fmt::format("end {} {} {} 0", number, now_ns(), done ? "ok" : "refused"));
  return done;
}

bool Stage::drive_by_command(int joint, bool up) {
  const int number = ++commands_;
  const std::int64_t mark = signature(kByCommand, number % static_cast<int>(kCallsPerClient - 1) + 1);
  const double by_deg = (up ? 1.0 : -1.0) * sign_degrees(2, mark);
  report(fmt::format("begin {} {} Drive {} 0 {} {:.12f}", number, now_ns(), mark, joint, by_deg));
  const test::RunResult result =
      corbot({"drive", "--robot", name_, std::to_string(joint), fmt::format("{:.12f}", by_deg), "90"});
  // Whatever else it may have been: it did not say that it is done.
  report(fmt::format("end {} {} {} 0", number, now_ns(), result.code == 0 ? "ok" : "NotReady"));
  return result.code == 0;
}

void Stage::stop_by_command() {
  const int number = ++commands_;
  report(fmt::format("begin {} {} {} 0 0", number, now_ns(), kLocalStop));
  stops_.push_back(
      {number, test::Process({options_.binaries + "/corbot", "stop", "--robot", name_}, environment())});
}

void Stage::read_stops() {
  stops_.remove_if([&](StopCommand& stop) {
    if (stop.process.running()) return false;
    const bool confirmed = stop.process.wait(test::within(0)).value_or(-1) == 0;
    report(fmt::format("end {} {} {} 0", stop.number, now_ns(), confirmed ? "ok" : "unconfirmed"));
    return true;
  });
}

void Stage::clear(const std::string& cause) {
  Clear clear{{now_ns(), 0}, cause};
  clear.done = corbot({"clear", "--robot", name_}).code == 0;
  clear.end_ns = now_ns();
  clears_.push_back(clear);
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
      if (!cause.empty()) clear(cause);
    }
    pause();
  }
  return false;
}

bool Stage::quiesce() {
  // A client that is frozen between two calls begins no other; one whose call is under way is let go on until
  // it ends. Held, or paused by a client that was killed since, nothing would.
  constexpr std::int64_t kHelp_ns = 1'000'000'000;
  const auto deadline = within(kMinute_s);
  std::int64_t helped_ns = now_ns();
  // Twice: a client is frozen a moment after the signal was sent.
  for (int quiet = 0; quiet < 2;) {
    if (test::Deadline::clock::now() > deadline) return false;
    bool waiting = !stops_.empty() || recording_.is_paused() || recording_.is_in_error();
    for (Client& client : clients_) {
      client.process.signal(SIGSTOP);
      read_lines(client.process, client.read, client.number);
      if (!ledger_.waiting_since(client.number)) continue;
      client.process.signal(SIGCONT);
      waiting = true;
    }
    observe();
    quiet = waiting ? 0 : quiet + 1;
    if (waiting && now_ns() - helped_ns > kHelp_ns) {
      if (recording_.is_in_error()) (void)recover();
      // A client with control of a paused arm that waits for a motion keeps others from resuming it, not from
      // a stop.
      if (!resume()) stop_by_command();
      helped_ns = now_ns();
    }
    pause();
  }
  return true;
}

void Stage::hold_clients() {
  for (Client& client : clients_) client.process.signal(SIGSTOP);
}

void Stage::go_on() {
  for (Client& client : clients_) client.process.signal(SIGCONT);
}

std::string Stage::check_rest(const std::vector<std::string>& names) {
  return rest_.look([&] {
    observe();
    std::map<std::string, pid_t> processes;  // one may be replaced meanwhile
    for (const std::string& name : names)
      processes[name] = name == "servant" ? servant() : name == "task" ? task() : supervisor();
    return processes;
  });
}

std::vector<std::string> Stage::wrong_tickets(bool ended) {
  constexpr std::size_t kKept = 1000;
  std::vector<std::uint64_t> tickets;
  for (const Call& call : ledger_.calls()) {
    if (call.accepted() && call.ticket != 0 && call.begin_ns >= life_begin_ns_)
      tickets.push_back(call.ticket);
  }
  std::sort(tickets.begin(), tickets.end());
  if (tickets.size() > kKept) tickets.erase(tickets.begin(), tickets.end() - kKept);
  const auto ask = [&] {
    std::vector<std::string> words{options_.client,
                                   fmt::format("corbaloc::1.2@127.0.0.1:{}/{}", port_, name_), "tickets"};
    for (const std::uint64_t ticket : tickets) words.push_back(std::to_string(ticket));
    std::istringstream lines(run(words, kMinute_s).output);
    std::vector<std::string> wrong;
    std::size_t answers = 0;
    for (std::string line; std::getline(lines, line); ++answers) {
      const bool is_pending = line.ends_with("queued") || line.ends_with("running");
      const bool has_ended = line.ends_with("done") || line.ends_with("stopped") || line.ends_with("failed");
      if (is_pending ? ended : !has_ended) wrong.push_back(line);
    }
    if (answers != tickets.size()) wrong.push_back(fmt::format("{} of {} answered", answers, tickets.size()));
    return wrong;
  };
  std::vector<std::string> wrong;
  (void)test::wait_until(within(kMinute_s), [&] { return (wrong = ask()).empty() || !ended; });
  return wrong;
}

std::string Stage::take_down() {
  for (Client& client : clients_) client.process.signal(SIGKILL);
  observe();
  clients_.clear();
  stops_.clear();
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
  return left + leftovers(name_, options_.scratch, port_);
}

}  // namespace corbot::soak
