// SPDX-License-Identifier: Apache-2.0
#include "architecture/linked_libraries.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <regex>
#include <stdexcept>

namespace corbot::test {
namespace {

namespace fs = std::filesystem;

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

std::vector<std::string> linked_libraries(const fs::path& program) {
  static const std::regex kLibrary("(lib[A-Za-z0-9_+.-]+\\.so[0-9.]*)");
  const std::string text = output_of("ldd '" + program.string() + "' 2>&1");
  std::vector<std::string> libraries;
  for (std::sregex_iterator i(text.begin(), text.end(), kLibrary), end; i != end; ++i)
    libraries.push_back((*i)[1]);
  if (libraries.empty())
    throw std::runtime_error("ldd printed nothing for " + program.string() + ": " + text);
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
