// SPDX-License-Identifier: Apache-2.0
#include "architecture/source_rules.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <regex>
#include <stdexcept>

namespace corbot::test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestHeader = 250;
constexpr std::size_t kLongestSource = 400;

/// The files of rt/ that set up, log and end: they may use the configuration and streams. All others are the
/// cyclic part.
constexpr std::array<const char*, 14> kSetUp{"rt/main.cpp",
                                             "rt/loop.h",
                                             "rt/loop.cpp",
                                             "rt/realtime_setup.h",
                                             "rt/realtime_setup.cpp",
                                             "rt/housekeeping.h",
                                             "rt/housekeeping.cpp",
                                             "rt/safety_settings.h",
                                             "rt/safety_settings.cpp",
                                             "rt/start_position.h",
                                             "rt/start_position.cpp",
                                             "rt/backends/registry.h",
                                             "rt/backends/registry.cpp",
                                             "rt/CMakeLists.txt"};

/// Directories of src/, as they are spelt in an include.
const std::regex kFromSource("(\\.\\./)*(src|config|planner|robot|state|orb|cell|cli)/.*");
const std::regex kStreamOrParser(
    "iostream|istream|ostream|fstream|sstream|iomanip|streambuf|cstdio|stdio\\.h|spdlog/.*|fmt/.*|CLI/"
    ".*|toml.*");
const std::regex kFromOthers("(\\.\\./)*(src|rt|sim|config|planner|robot|state|orb|cell|cli|tests)/.*");
const std::regex kOrb(
    "omniORB.*|COS/.*|omnithread\\.h|orbit.*|ORBit.*|.*CORBA\\.h|.*idl/.*|.*(arm|robot)\\.hh");

struct Include {
  std::size_t line;
  std::string path;
};

bool is_code(const fs::path& file) {
  static const std::array<std::string, 5> kEndings{".h", ".hh", ".cpp", ".cc", ".c"};
  return std::find(kEndings.begin(), kEndings.end(), file.extension()) != kEndings.end();
}

std::vector<Include> includes_of(const fs::path& file, std::size_t& lines) {
  static const std::regex kPattern("\\s*#\\s*include\\s*[<\"]([^>\"]+)[>\"].*");
  std::vector<Include> includes;
  std::ifstream stream(file);
  std::string text;
  std::smatch match;
  for (lines = 0; std::getline(stream, text);) {
    ++lines;
    if (std::regex_match(text, match, kPattern)) includes.push_back({lines, match[1]});
  }
  return includes;
}

class Checker {
 public:
  explicit Checker(const fs::path& root) : root_(root) {}

  std::vector<std::string> run() {
    for (const char* directory : {"include", "src", "rt", "sim", "tests"}) {
      if (!fs::exists(root_ / directory)) continue;
      for (const auto& entry : fs::recursive_directory_iterator(root_ / directory)) {
        if (entry.is_regular_file() && is_code(entry.path())) check(entry.path());
      }
    }
    return found_;
  }

 private:
  void check(const fs::path& file) {
    const std::string name = file.lexically_relative(root_).generic_string();
    std::size_t lines = 0;
    for (const Include& include : includes_of(file, lines)) check_include(name, include);
    const std::size_t most = file.extension() == ".h" ? kLongestHeader : kLongestSource;
    if (lines > most) {
      found_.push_back(name + ": " + std::to_string(lines) + " lines, at most " + std::to_string(most));
    }
  }

  void check_include(const std::string& name, const Include& include) {
    const bool cyclic =
        name.starts_with("rt/") && std::find(kSetUp.begin(), kSetUp.end(), name) == kSetUp.end();
    if (cyclic) {
      forbid(name, include, kFromSource, "the cyclic part includes nothing from src/");
      forbid(name, include, kStreamOrParser, "the cyclic part uses no stream, logger or parser");
    }
    if (name.starts_with("rt/") || name.starts_with("sim/")) {
      forbid(name, include, kOrb, "the real-time side knows no ORB");
    }
    if (name.starts_with("sim/"))
      forbid(name, include, kFromSource, "the simulator includes nothing from src/");
    if (name.starts_with("include/corbot/")) {
      forbid(name, include, kFromOthers, "include/corbot stands alone");
      forbid(name, include, kOrb, "include/corbot knows no ORB");
    }
    if (name.starts_with("src/robot/")) forbid(name, include, kOrb, "src/robot knows no ORB");
  }

  void forbid(const std::string& name, const Include& include, const std::regex& pattern, const char* rule) {
    if (!std::regex_match(include.path, pattern)) return;
    found_.push_back(name + ":" + std::to_string(include.line) + ": includes " + include.path + "; " + rule);
  }

  fs::path root_;
  std::vector<std::string> found_;
};

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  if (!pipe) throw std::runtime_error("cannot run " + command);
  std::string text;
  std::array<char, 4096> buffer{};
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe.get()))
    text.append(buffer.data(), n);
  return text;
}

}  // namespace

std::vector<std::string> breaches(const fs::path& root) { return Checker(root).run(); }

std::vector<std::string> linked_libraries(const fs::path& program) {
  static const std::regex kLibrary("(lib[A-Za-z0-9_+.-]+\\.so[0-9.]*)");
  const std::string text = output_of("ldd '" + program.string() + "' 2>&1");
  std::vector<std::string> libraries;
  for (std::sregex_iterator i(text.begin(), text.end(), kLibrary), end; i != end; ++i)
    libraries.push_back((*i)[1]);
  if (libraries.empty()) throw std::runtime_error("ldd told nothing of " + program.string() + ": " + text);
  return libraries;
}

std::vector<std::string> orbs_among(const std::vector<std::string>& libraries) {
  static const std::regex kOrbLibrary("lib(omni|ORBit|TAO|COS|ACE).*");
  std::vector<std::string> orbs;
  std::copy_if(libraries.begin(), libraries.end(), std::back_inserter(orbs),
               [](const std::string& name) { return std::regex_match(name, kOrbLibrary); });
  return orbs;
}

}  // namespace corbot::test
