// SPDX-License-Identifier: Apache-2.0
#include "client/program.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <span>

#include "client/failure.h"

namespace corbot::client {

namespace {

constexpr std::string_view kBlanks = " \t\r";

std::vector<std::string> split(std::string_view line) {
  std::vector<std::string> words;
  for (std::size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    words.emplace_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlanks, end);
  }
  return words;
}

/// Returns the line without comment and surrounding blanks.
std::string_view bare(std::string_view line) {
  line = line.substr(0, line.find('#'));
  const std::size_t first = line.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return line.substr(first, line.find_last_not_of(kBlanks) - first + 1);
}

bool is_text(std::string_view line) {
  return std::none_of(line.begin(), line.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < 0x20 && c != '\t' && c != '\r') || byte == 0x7f;
  });
}

void parse_line(std::string_view line, std::size_t number, Program& program) {
  if (!is_text(line)) {
    program.faults.push_back({number, "the line has a control character: write a program as plain text"});
    return;
  }
  const std::string_view text = bare(line);
  if (text.empty()) return;
  if (text.size() > kMaxProgramLineBytes) {
    program.faults.push_back({number, fmt::format("longer than {} bytes", kMaxProgramLineBytes)});
    return;
  }
  const auto parsed = parse_request(split(text));
  if (const auto* fault = std::get_if<std::string>(&parsed)) {
    program.faults.push_back({number, *fault});
    return;
  }
  const auto& request = std::get<Request>(parsed);
  const VerbSpec& spec = spec_of(request.verb);
  if (!spec.in_program) {
    program.faults.push_back(
        {number, fmt::format("'{}' is not for programs: give it from another terminal, 'corbot {}'",
                             spec.word, spec.word)});
    return;
  }
  if (request.verb == Verb::kSpeed && request.numbers.empty()) {
    program.faults.push_back({number, "PERCENT missing; usage: " + usage_of(spec)});
    return;
  }
  if (request.verb == Verb::kFrames && !request.reset) {
    program.faults.push_back(
        {number, "--reset is missing: a program cannot show frames, write 'frames --reset'"});
    return;
  }
  program.statements.push_back({number, std::string(text), request});
}

}  // namespace

Program parse_program(std::string_view text) {
  Program program;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // a byte-order mark, which some editors write
  std::size_t number = 1;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    parse_line(text.substr(0, end), number++, program);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return program;
}

std::string read_program(const std::string& file) {
  std::ifstream stream;
  if (file != "-") {
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored)) {
      throw Failure(ExitCode::kUsage, fmt::format("{}: is a directory, not a program", file));
    }
    stream.open(file, std::ios::binary);
    if (!stream) throw Failure(ExitCode::kUsage, fmt::format("{}: {}", file, std::strerror(errno)));
  }
  std::istream& in = file == "-" ? std::cin : stream;
  std::string text(kMaxProgramBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kMaxProgramBytes) {
    throw Failure(ExitCode::kUsage, fmt::format("{}: longer than {} bytes", file, kMaxProgramBytes));
  }
  return text;
}

std::string describe_others(const Program& program, std::size_t failed) {
  const auto part = [&](std::size_t first, std::size_t end, const char* one, const char* several) {
    if (first >= end) return std::string();
    const std::size_t from = program.statements[first].line;
    const std::size_t to = program.statements[end - 1].line;
    return from == to ? fmt::format("; line {} {}", from, one)
                      : fmt::format("; lines {} to {} {}", from, to, several);
  };
  return part(0, failed, "was done", "were done") +
         part(failed + 1, program.statements.size(), "was not begun", "were not begun");
}

std::size_t faults_shown(const Program& program) {
  const std::size_t most = program.statements.empty() ? kMostFaultsOfNoProgram : kMostFaultsShown;
  return std::min(program.faults.size(), most);
}

std::string describe_faults(const Program& program, std::string_view file) {
  std::string text;
  for (const auto& fault : std::span(program.faults).first(faults_shown(program)))
    text += fmt::format("{}:{}: {}\n", file, fault.line, fault.reason);
  return text;
}

void check_program(const Program& program) {
  if (const std::size_t count = program.faults.size(); count > 0)
    throw Failure(ExitCode::kUsage,
                  fmt::format("{}{} line{} to fix{}; nothing moved", describe_faults(program, program.name),
                              count, count == 1 ? "" : "s",
                              count > faults_shown(program)
                                  ? fmt::format(", of which {} are shown", faults_shown(program))
                                  : ""));
  if (program.statements.empty())
    throw Failure(ExitCode::kUsage,
                  fmt::format("{}: the program has no command; nothing moved", program.name));
}

void carry_out(const Program& program, const Perform& perform) {
  for (std::size_t i = 0; i < program.statements.size(); ++i) {
    const Statement& statement = program.statements[i];
    try {
      perform(i, statement);
    } catch (const Failure& failure) {
      throw Failure(failure.code(), fmt::format("{}:{}: {}: {}{}", program.name, statement.line,
                                                statement.text, failure.what(), describe_others(program, i)));
    }
  }
}

}  // namespace corbot::client
