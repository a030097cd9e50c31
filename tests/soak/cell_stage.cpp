// SPDX-License-Identifier: Apache-2.0
#include "soak/cell_stage.h"

#include <fmt/format.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <sstream>
#include <stdexcept>

#include "support/paths.h"
#include "support/ports.h"

namespace corbot::soak {

namespace fs = std::filesystem;
using test::within;

namespace {

constexpr double kCellReply_s = 30;
constexpr double kCellUp_s = 90;
constexpr int kPorts = 5;
constexpr const char* kCellCommand = "cell up";

fs::path copy_of_cell() {
  std::string path = (fs::temp_directory_path() / "corbot-soak-XXXXXX").string();
  if (::mkdtemp(path.data()) == nullptr) throw std::runtime_error(path + " cannot be made");
  for (const auto& entry : fs::directory_iterator(CORBOT_TIMED_CELL)) fs::copy(entry.path(), path);
  return path;
}

/// Links to the programs, with the planted coordinator in place of the plain one.
fs::path with_planted(const fs::path& programs, const fs::path& links) {
  fs::create_directory(links);
  for (const auto& entry : fs::directory_iterator(programs)) {
    const fs::path name = entry.path().filename();
    if (name != "corbot" && name != "corbot-coordinator") fs::create_symlink(entry.path(), links / name);
  }
  fs::create_symlink(programs.parent_path() / "tests" / "planted_coordinator", links / "corbot-coordinator");
  // A program finds those beside it by its own file, to which a symbolic link would lead back.
  fs::copy_file(programs / "corbot", links / "corbot");
  return links;
}

}  // namespace

CellStage::CellStage(const fs::path& programs, int pieces, std::uint32_t seed, const std::string& planted)
    : pieces_(pieces),
      seed_(seed),
      ports_(test::free_ports(kPorts)),
      name_(fmt::format("soak{}", ports_)),
      planted_(planted),
      directory_(copy_of_cell()),
      programs_(planted.empty() ? programs : with_planted(programs, directory_ / "bin")) {
  world_.emplace(words("corbot-scene", ""), environment());
  if (!world_->wait_line("ready", within(kCellUp_s)))
    throw std::runtime_error("no world: " + world_->errors());
  if (const std::string why = start(); !why.empty()) throw std::runtime_error(why);
}

CellStage::~CellStage() {
  up_.reset();
  std::error_code ignored;
  if (!is_kept_) fs::remove_all(directory_, ignored);
}

std::vector<std::string> CellStage::words(const std::string& program, const std::string& verb) const {
  std::vector<std::string> words{(programs_ / program).string()};
  if (!verb.empty()) words.insert(words.end(), {"cell", verb});
  words.insert(words.end(), {(directory_ / "cell.toml").string(), "--name", name_, "--ports",
                             std::to_string(ports_), "--state-dir", (directory_ / "state").string()});
  if (verb.empty() || verb == "up")
    words.insert(words.end(), {"--pieces", std::to_string(pieces_), "--seed", std::to_string(seed_)});
  return words;
}

std::vector<std::string> CellStage::environment() const {
  return {"XDG_RUNTIME_DIR=" + directory_.string(), "CORBOT_PLANTED=" + planted_};
}

test::RunResult CellStage::run(std::vector<std::string> command) const {
  return test::run(std::move(command), kCellReply_s,
                   {"XDG_RUNTIME_DIR=" + directory_.string(), "CORBOT_ROBOT="});
}

std::string CellStage::start() {
  up_.reset();
  const auto left = [&] {
    std::istringstream pids(
        run({"/usr/bin/pgrep", "-f", fmt::format("{}|{}-robot", directory_.string(), name_)}).output);
    for (pid_t pid = 0; pids >> pid;)
      if (pid != world_->pid()) return true;
    return false;
  };
  if (!test::wait_until(within(kCellUp_s), [&] { return !left(); }))
    return "a killed cell has left processes";
  up_.emplace(words("corbot", "up"), environment());
  const auto deadline = within(kCellUp_s);
  // The first line of a worker comes when the cell is up.
  return up_->wait_line(name_ + " is up", deadline) ? "" : "the cell did not start: " + up_->errors();
}

std::vector<std::string> CellStage::victims() {
  std::vector<std::string> all{kCellCommand, "coordinator", "store", "camera"};
  for (const char* robot : {"robot1", "robot2"})
    for (const char* process : {"up", "task", "servant"}) all.push_back(fmt::format("{} {}", robot, process));
  return all;
}

pid_t CellStage::pid_of(const std::string& victim) const {
  if (victim == kCellCommand) return up_ ? up_->pid() : 0;
  const auto space = victim.find(' ');
  const std::string robot = victim.substr(0, space);
  const std::string process = space == std::string::npos ? "" : victim.substr(space + 1);
  std::string pattern = fmt::format("^[^ ]*corbot-{} {}/cell.toml", victim, directory_.string());
  if (process == "up")
    pattern = fmt::format("^[^ ]*corbot up {}/state/robots/{}.toml", directory_.string(), robot);
  if (process == "task") pattern = fmt::format("^[^ ]*corbot-rt .*{}-{}", name_, robot);
  if (process == "servant") pattern = fmt::format("^[^ ]*corbot-servant .*{}-{}", name_, robot);
  std::istringstream found(run({"/usr/bin/pgrep", "-o", "-f", pattern}).output);
  pid_t pid = 0;
  return found >> pid ? pid : 0;
}

std::string CellStage::status() const {
  const test::RunResult result = run(words("corbot", "status"));
  return result.code == 0 ? result.output : "";
}

std::string CellStage::address(const std::string& robot) const {
  return fmt::format("127.0.0.1:{}/{}-{}", ports_ + (robot == "robot1" ? 3 : 4), name_, robot);
}

bool CellStage::clear(const std::string& robot) const {
  return run({(programs_ / "corbot").string(), "--robot", address(robot), "clear"}).code == 0;
}

std::string CellStage::tell_world(const std::string& line) {
  world_->send(line);
  return world_->wait_line("", within(kCellReply_s)).value_or("");
}

bool CellStage::exchange(const std::string& place) const {
  std::vector<std::string> command = words("corbot", "exchange");
  command.push_back(place);
  return run(std::move(command)).code == 0;
}

std::string CellStage::end() {
  if (run(words("corbot", "down")).code != 0) return "";
  const auto ended = up_->wait(within(kCellUp_s));
  if (!ended || !WIFEXITED(*ended) || WEXITSTATUS(*ended) != 0 || world_->terminate() != 0) return "";
  const std::string& text = world_->output();
  const auto at = text.find("end ");
  return at == std::string::npos ? "" : text.substr(at + 4, text.find('\n', at) - at - 4);
}

fs::path CellStage::keep() {
  is_kept_ = true;
  return directory_;
}

}  // namespace corbot::soak
