// SPDX-License-Identifier: Apache-2.0
#include "config/load_profile.h"

#include <algorithm>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "config/schema.h"
#include "config/similar.h"

namespace corbot {
namespace {

[[noreturn]] void refuse_file(const std::string& file, std::string why) {
  throw ConfigError{{ConfigFault{file, 0, "", "", std::move(why), ""}}};
}

namespace fs = std::filesystem;

/// Returns the file `path`.toml, or the profile beside `path` that `path` most likely misspells, or "".
fs::path similar_file(const fs::path& path) {
  std::error_code ignored;
  fs::path with_ending = fs::path(path) += ".toml";
  if (fs::is_regular_file(with_ending, ignored)) return with_ending;
  const fs::path directory = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::vector<std::string> stems;
  for (fs::directory_iterator entry{directory, ignored}, end; !ignored && entry != end;
       entry.increment(ignored)) {
    if (entry->path().extension() == ".toml") stems.push_back(entry->path().stem().string());
  }
  std::sort(stems.begin(), stems.end());
  const std::vector<std::string_view> known(stems.begin(), stems.end());
  const std::string_view near = most_similar(path.stem().string(), known, kSimilarKey);
  return near.empty() ? fs::path() : fs::path(path).replace_filename(std::string(near) + ".toml");
}

/// Returns the path of the shipped profile of that name, or "".
fs::path shipped_file(const fs::path& path) {
  if (path.has_parent_path() || (path.has_extension() && path.extension() != ".toml")) return {};
  std::error_code ignored;
  const fs::path installed =
      fs::read_symlink("/proc/self/exe", ignored).parent_path().parent_path() / "share/corbot";
  for (const fs::path& directory : {fs::path("profiles"), installed / "profiles"}) {
    fs::path shipped = (directory / path.stem()).replace_extension(".toml");
    if (fs::is_regular_file(shipped, ignored)) return shipped;
  }
  return {};
}

/// Returns "; did you mean 'profiles/lynx5.toml'?" for a name that is no file but similar to a profile, else
/// "".
std::string suggest_profile(const fs::path& path) {
  fs::path found = shipped_file(path);
  if (found.empty()) found = similar_file(path);
  return found.empty() ? "" : fmt::format("; did you mean '{}'?", found.string());
}

}  // namespace

std::string read_profile_text(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found)
    refuse_file(path.string(), "no such file" + suggest_profile(path));
  if (error) refuse_file(path.string(), "cannot be read: " + error.message());
  if (!std::filesystem::is_regular_file(status)) refuse_file(path.string(), "is not a file");
  std::ifstream stream{path, std::ios::binary};
  if (!stream) refuse_file(path.string(), "cannot be opened: check its permissions");
  // One byte more than allowed, so that parse_profile detects a file that is too large.
  std::string text(kMaxProfileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) refuse_file(path.string(), "cannot be read");
  text.resize(static_cast<std::size_t>(stream.gcount()));
  return text;
}

Profile load_profile(const std::filesystem::path& path) {
  return parse_profile(read_profile_text(path), path.string());
}

Profile parse_profile(std::string_view text, std::string file) {
  if (text.size() > kMaxProfileBytes)
    refuse_file(file, fmt::format("is larger than {} bytes, the limit of a profile", kMaxProfileBytes));
  Profile profile;
  profile.file = file;
  FaultList faults{std::move(file), {}};
  try {
    const toml::table root = toml::parse(text, faults.file);
    if (root.contains("cell") && !root.contains("joint"))
      refuse_file(faults.file, "is a cell file, not a robot's profile: 'corbot cell run' takes it");
    read_schema(root, profile, faults);
  } catch (const toml::parse_error& error) {
    faults.add(static_cast<std::uint32_t>(error.source().begin.line), "", "",
               fmt::format("not TOML: {}", error.description()));
  }
  if (faults.faults.empty()) return profile;
  std::stable_sort(faults.faults.begin(), faults.faults.end(),
                   [](const ConfigFault& a, const ConfigFault& b) { return a.line < b.line; });
  throw ConfigError{std::move(faults.faults)};
}

}  // namespace corbot
