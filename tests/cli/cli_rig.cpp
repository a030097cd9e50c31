// SPDX-License-Identifier: Apache-2.0
#include "cli_rig.h"

#include <signal.h>
#include <sys/stat.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include "support/paths.h"
#include "support/ports.h"

namespace corbot::test {

namespace fs = std::filesystem;

namespace {

std::vector<std::string> command(const std::vector<std::string>& arguments) {
  std::vector<std::string> words{CORBOT_BIN_DIR "/corbot"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return words;
}

}  // namespace

CliRig::CliRig() : name_(unique_name("cli")), port_(free_port()) {
  std::string path = CORBOT_SCRATCH_DIR "/cli-XXXXXX";
  directory_ = ::mkdtemp(path.data());
}

CliRig::~CliRig() {
  if (supervisor_) {
    EXPECT_EQ(supervisor_->terminate(), 0) << supervisor_->errors();
  }
  EXPECT_FALSE(channel_exists(name_, directory_.string()));
  const fs::path states = directory_ / "corbot";
  EXPECT_TRUE(!fs::exists(states) || fs::is_empty(states)) << "state files are left in " << states;
  fs::remove_all(directory_);
}

std::vector<std::string> CliRig::environment() const {
  return {"XDG_RUNTIME_DIR=" + directory_.string(), "CORBOT_ROBOT="};
}

void CliRig::up(const std::vector<std::string>& more, const std::string& profile) {
  std::vector<std::string> arguments{"up",  profile,      "--name",
                                     name_, "--endpoint", "127.0.0.1:" + std::to_string(port_)};
  if (on_orbit2()) arguments.insert(arguments.end(), {"--orb", "orbit2"});
  arguments.insert(arguments.end(), more.begin(), more.end());
  supervisor_ = begin(arguments);
  ASSERT_TRUE(supervisor_->wait_line(name_ + " is up", within(30))) << supervisor_->errors();
}

RunResult CliRig::corbot(const std::vector<std::string>& arguments, double seconds) {
  return run(command(arguments), seconds, environment());
}

std::unique_ptr<Process> CliRig::begin(const std::vector<std::string>& arguments,
                                       const std::string& terminal) {
  if (terminal.empty()) return begin_in({}, arguments);
  return begin_in({"/bin/sh", "-c", "exec \"$@\" <\"$0\"", terminal}, arguments);
}

std::unique_ptr<Process> CliRig::begin_in(std::vector<std::string> wrapper,
                                          const std::vector<std::string>& arguments) {
  const std::vector<std::string> words = command(arguments);
  wrapper.insert(wrapper.end(), words.begin(), words.end());
  return std::make_unique<Process>(wrapper, environment());
}

std::string CliRig::put(const std::string& file, const std::string& text) const {
  const fs::path path = directory_ / file;
  std::ofstream(path) << text;
  return path.string();
}

std::string CliRig::put_ssc32_profile(const std::string& line, const std::string& more, bool known) const {
  std::ifstream stream(CORBOT_TEST_PROFILE);
  std::string text{std::istreambuf_iterator<char>{stream}, {}};
  // A robot of the shipped name may be up on this machine.
  constexpr std::string_view kShipped = "lynx5";
  text.replace(text.find("name = \"lynx5\"") + 8, kShipped.size(), name_);
  return put("arm.toml", text.substr(0, text.find("[backend]")) + "[backend]  # mine\nkind = \"ssc32\"\n" +
                             (known ? "position_known_at_start = true\n" : "") +
                             "[backend.ssc32]\nport = \"" + line + "\"\n" + more);
}

nlohmann::json CliRig::status() {
  const RunResult result = corbot({"status", "--json"});
  if (result.code != 0) return nlohmann::json::object();
  return nlohmann::json::parse(result.output);
}

nlohmann::json CliRig::state() const {
  std::ifstream stream(directory_ / "corbot" / (name_ + ".json"));
  return nlohmann::json::parse(stream);
}

bool CliRig::wait_state(const std::string& word, double seconds) {
  return wait_until(within(seconds), [&] { return status().value("state", "") == word; });
}

bool has_ended(pid_t pid) {
  if (::kill(pid, 0) != 0) return true;
  const std::string process = "/proc/" + std::to_string(pid);
  // The first thread may be a zombie while another still ends, and with it the process's descriptors.
  std::error_code gone;
  const auto threads =
      std::distance(fs::directory_iterator(process + "/task", gone), fs::directory_iterator());
  if (gone || threads > 1) return static_cast<bool>(gone);
  std::ifstream stream(process + "/stat");
  std::string line;
  std::getline(stream, line);
  const std::size_t name_end = line.rfind(") ");
  return name_end == std::string::npos || line[name_end + 2] == 'Z';
}

}  // namespace corbot::test
