// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/calibrate_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "cli/calibrate/calibrate_help.h"
#include "client/explain.h"
#include "client/failure.h"
#include "client/notice.h"
#include "client/number.h"
#include "config/load_profile.h"
#include "shm/run_directory.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::parse_number;
using client::printable;

namespace {

constexpr double kPulseTolerance_us = 0.01;

std::vector<std::string> words_of(const std::string& line) {
  std::string spaced;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '#') break;
    spaced += line[i];
    // accepts "+10" and "-1" like "+ 10" and "- 1"
    if ((line[i] == '+' || line[i] == '-') && spaced.find_first_not_of(" \t\r") == spaced.size() - 1)
      spaced += ' ';
  }
  std::istringstream stream(spaced);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// Throws std::runtime_error unless the edited text describes the calibration.
void check(const Profile& before, const std::string& text, const Calibration& calibration) {
  const Profile now = parse_profile(text, before.file);
  constexpr double kTolerance = 1e-6;
  for (std::size_t i = 0; i < calibration.joints(); ++i) {
    const ServoLine line = calibration.line(i);
    const ServoMap& map = now.arm.servos[i];
    for (const double value : calibration.range(i)) {
      const double q = value * calibration.unit(i).q_per_unit;
      const double pulse_us = map.zero_us + map.direction * map.us_per_q * q;
      if (std::abs(pulse_us - line.pulse_us(value)) > kTolerance)
        throw std::runtime_error(
            fmt::format("joint {}: the edited text does not have the calibrated values", i));
    }
  }
  if (now.arm.gripper.closed_us != calibration.gripper_us(false) ||
      now.arm.gripper.open_us != calibration.gripper_us(true))
    throw std::runtime_error("gripper: the edited text does not have the calibrated values");
}

}  // namespace

CalibrateSession::CalibrateSession(const Setting& setting, ServoPositioner& servos)
    : setting_(setting), servos_(servos), calibration_(setting.profile) {}

void CalibrateSession::print_introduction() {
  print_log();
  fmt::print("{} on {}: {}.\n'on' begins at {}.\n{}", setting_.profile.file, setting_.profile.backend.kind,
             servos_.origin(), positions(), calibrate_help());
}

void CalibrateSession::run(const std::string& line) {
  ++line_;
  const Words words = words_of(line);
  if (words.empty()) return;
  if (words[0] != "quit") quit_once_ = false;
  try {
    execute(words);
  } catch (const std::invalid_argument& error) {
    if (!setting_.terminal) {
      const std::string why = error.what();
      throw Failure(ExitCode::kUsage, fmt::format("line {}: {}{}", line_, why,
                                                  why.ends_with(unwritten_note()) ? "" : unwritten_note()));
    }
    fmt::print("refused: {}\n", error.what());
  }
  print_log();
}

void CalibrateSession::execute(const Words& words) {
  const std::string& word = words[0];
  const bool was_asked = std::exchange(awaits_yes_, false);
  if (word == "help") {
    fmt::print("{}", calibrate_help());
  } else if (word == "on") {
    begin_to_switch_on();
  } else if (word == "yes") {
    if (!was_asked && servos_.is_on())
      throw std::invalid_argument("there is no question to answer with 'yes': the servos are on already");
    if (!was_asked) throw std::invalid_argument("there is no question to answer with 'yes': type 'on' first");
    switch_on();
  } else if (word == "joint") {
    choose(words);
  } else if (word == "+" || word == "-") {
    move(servos_.pulse_us(chosen()) + (word == "+" ? 1.0 : -1.0) * number(words));
  } else if (word == "goto") {
    move(number(words));
  } else if (word == "mark") {
    mark(words);
  } else if (word == "limit") {
    limit(words);
  } else if (word == "undo") {
    if (!calibration_.undo()) throw std::invalid_argument("there is nothing to undo");
    show();
  } else if (word == "show") {
    show();
  } else if (word == "write") {
    write();
  } else if (word == "quit") {
    quit();
  } else {
    throw std::invalid_argument(fmt::format("unknown command '{}'; 'help' lists them", printable(word)));
  }
}

void CalibrateSession::begin_to_switch_on() {
  if (!servos_.is_stored() || servos_.is_on()) return switch_on();
  awaits_yes_ = true;
  fmt::print(
      "'on' takes the servos AT FULL SPEED to {}, where corbot left the arm: 'yes' to go there; any other "
      "command leaves them without pulses\n",
      positions());
}

void CalibrateSession::switch_on() {
  try {
    servos_.switch_on();
  } catch (const std::runtime_error& error) {
    if (!servos_.is_on()) throw;
    throw std::invalid_argument(error.what());  // an emergency stop that is still pressed
  }
  fmt::print("the servos have their pulses\n");
}

double CalibrateSession::number(const Words& words) {
  if (words.size() != 2) throw std::invalid_argument(fmt::format("'{}' needs one number", words[0]));
  const auto value = parse_number(words[1]);
  if (!value) throw std::invalid_argument(fmt::format("'{}' is not a number", printable(words[1])));
  return *value;
}

std::size_t CalibrateSession::chosen() const {
  if (!servo_) throw std::invalid_argument("choose a servo first: 'joint NAME'");
  return *servo_;
}

std::string CalibrateSession::name(std::size_t servo) const {
  return servo == gripper() ? "gripper" : setting_.profile.joint_names[servo];
}

void CalibrateSession::choose(const Words& words) {
  const std::string wanted = words.size() == 2 ? words[1] : "";
  std::string known;
  for (std::size_t i = 0; i <= gripper(); ++i) {
    if (wanted == name(i) || wanted == fmt::format("{}", i)) {
      servo_ = i;
      return print_position();
    }
    known += (i == 0 ? "" : ", ") + name(i);
  }
  throw std::invalid_argument(fmt::format("'joint' needs the name or number of a servo: one of {}", known));
}

std::string CalibrateSession::positions() const {
  std::string text;
  for (std::size_t i = 0; i < gripper(); ++i) {
    text += fmt::format("{} {:.1f} {}, ", name(i), calibration_.line(i).value(servos_.pulse_us(i)) + 0.0,
                        calibration_.unit(i).name);
  }
  return text + fmt::format("gripper {:g} us", servos_.pulse_us(gripper()));
}

void CalibrateSession::print_position() {
  const std::size_t servo = chosen();
  if (servo == gripper()) {
    fmt::print("gripper {:g} us\n", servos_.pulse_us(servo));
  } else {
    fmt::print("{} {:g} us, {:.1f} {} by the present calibration\n", name(servo), servos_.pulse_us(servo),
               calibration_.line(servo).value(servos_.pulse_us(servo)) + 0.0, calibration_.unit(servo).name);
  }
}

void CalibrateSession::require_pulses() const {
  if (!servos_.is_on())
    throw std::invalid_argument("the servos have no pulses yet: keep clear of the arm, and type 'on' first");
}

void CalibrateSession::move(double pulse_us) {
  const std::size_t servo = chosen();
  require_pulses();
  if (!(pulse_us >= servos_.lowest_us(servo) - kPulseTolerance_us &&
        pulse_us <= servos_.highest_us(servo) + kPulseTolerance_us)) {
    throw std::invalid_argument(
        fmt::format("{:g} us is out of range: this servo takes pulses from {:g} to {:g} us", pulse_us,
                    servos_.lowest_us(servo), servos_.highest_us(servo)));
  }
  if (!servos_.go(servo, pulse_us) && servos_.is_lost()) fail_lost_device();
  print_position();
  if (servos_.is_stopped())
    throw std::invalid_argument("the emergency stop was pressed: release it, then type 'on'");
}

void CalibrateSession::mark(const Words& words) {
  const std::size_t servo = chosen();
  require_pulses();
  if (servo == gripper()) {
    if (words.size() != 2 || (words[1] != "open" && words[1] != "closed"))
      throw std::invalid_argument("write 'mark open' or 'mark closed' for the gripper");
    calibration_.mark_gripper(words[1] == "open", servos_.pulse_us(servo));
    fmt::print("gripper {} at {:g} us\n", words[1], servos_.pulse_us(servo));
    return;
  }
  if (words.size() == 2 && (words[1] == "open" || words[1] == "closed"))
    throw std::invalid_argument("choose 'joint gripper' first");
  const std::string fault = calibration_.mark(servo, {number(words), servos_.pulse_us(servo)});
  if (!fault.empty()) throw std::invalid_argument(fault);
  fmt::print("{}\n", calibration_.text(servo));
}

void CalibrateSession::limit(const Words& words) {
  const std::size_t servo = chosen();
  require_pulses();
  if (servo == gripper() || words.size() != 2 || (words[1] != "low" && words[1] != "high"))
    throw std::invalid_argument("choose a joint, and write 'limit low' or 'limit high'");
  const std::string fault = calibration_.limit(servo, words[1] == "high", servos_.pulse_us(servo));
  if (!fault.empty()) throw std::invalid_argument(fault);
  fmt::print("{}\n", calibration_.text(servo));
}

void CalibrateSession::show() {
  for (std::size_t i = 0; i < calibration_.joints(); ++i) fmt::print("{}\n", calibration_.text(i));
  fmt::print("gripper   closed_us {:g}, open_us {:g}\n", calibration_.gripper_us(false),
             calibration_.gripper_us(true));
  for (const std::string& fault : calibration_.faults()) fmt::print("! {}\n", fault);
}

void CalibrateSession::write() {
  const auto edits = calibration_.edits();
  if (edits.empty()) throw std::invalid_argument("nothing has changed");
  if (const auto faults = calibration_.faults(); !faults.empty()) {
    for (const std::string& fault : faults) fmt::print("! {}\n", fault);
    throw std::invalid_argument("fix the faults marked '!' first" + unwritten_note());
  }
  try {
    const std::string text = edit_numbers(setting_.text, edits);
    check(setting_.profile, text, calibration_);
    fmt::print("{}", changed_lines(setting_.text, text));
    if (setting_.dry_run) {
      remember_written(edits);
      fmt::print("nothing was written (--dry-run)\n");
      return;
    }
    const std::string file = link_target(setting_.profile.file);
    replace_file(file, setting_.text, text);
    written_ = true;
    remember_written(edits);
    // A task that was killed has left pulses of the old servo map: no servant may wait for a task with these.
    remove_left_behind(setting_.name);
    (void)load_profile(setting_.profile.file);
    fmt::print(
        "written: {0}{1}; the old one is {0}.bak\n", file,
        file == setting_.profile.file ? "" : fmt::format(", to which {} is a link", setting_.profile.file));
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument(error.what() + unwritten_note());
  }
}

void CalibrateSession::remember_written(const std::vector<NumberEdit>& edits) {
  written_edits_.clear();
  for (const NumberEdit& edit : edits) written_edits_[edit.path] = edit.value;
}

std::string CalibrateSession::unwritten() const {
  std::set<std::string> servos;  // names such as "joint[2]", "gripper"
  for (const NumberEdit& edit : calibration_.edits()) {
    const auto kept = written_edits_.find(edit.path);
    if (kept == written_edits_.end() || kept->second != edit.value)
      servos.insert(edit.path.substr(0, edit.path.find('.')));
  }
  if (servos.empty()) return "";
  return fmt::format("{} {} marked and not written", servos.size(),
                     servos.size() == 1 ? "joint was" : "joints were");
}

std::string CalibrateSession::unwritten_note() const {
  const std::string lost = written_ ? unwritten() : "nothing is written";
  return lost.empty() ? "" : "; " + lost;
}

void CalibrateSession::quit() {
  const std::string lost = unwritten();
  if (setting_.terminal && !lost.empty() && !std::exchange(quit_once_, true)) {
    fmt::print("{}: type 'write' to keep the values, or 'quit' again to lose them\n", lost);
    return;
  }
  done_ = true;
}

void CalibrateSession::report_unwritten() const {
  const std::string lost = unwritten();
  if (lost.empty() || quit_once_) return;
  std::fflush(stdout);
  client::notice(stderr, fmt::format("corbot: {}\n", lost));
}

void CalibrateSession::fail_lost_device() {
  print_log();
  throw Failure(ExitCode::kInternal, fmt::format("the device is lost{}{}{}", lost_text_.empty() ? "" : ": ",
                                                 lost_text_, unwritten_note()));
}

void CalibrateSession::print_log() {
  for (const LogLine& line : servos_.drain_log()) {
    if (line.kind == LogLine::Kind::kLost) lost_text_ = printable(line.text);
    fmt::print("{}: {}\n", setting_.profile.backend.kind, printable(to_string(line)));
  }
}

}  // namespace corbot::cli
