// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_pictures.h"

#include <cerrno>
#include <fstream>
#include <string>
#include <string_view>

#include "cell/pictures/cell_animation.h"
#include "cli/cell/gantt.h"
#include "client/failure.h"

namespace corbot::cli {
namespace {

namespace fs = std::filesystem;
using client::ExitCode;
using client::Failure;

constexpr const char* kAnimation = "cell.svg";
constexpr const char* kGantt = "gantt.svg";
constexpr const char* kCamera = "camera.jpg";

/// Writes the whole text, or removes the file.
void write_file(const fs::path& path, std::string_view text) {
  errno = 0;
  std::ofstream file(path);
  if ((file << text).flush()) return;
  const int error = errno;
  std::error_code ignored;
  fs::remove(path, ignored);
  throw client::system_failure(path, error);
}

}  // namespace

void prepare_pictures(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error)
    throw Failure(ExitCode::kInternal,
                  "--pictures " + directory.string() + " cannot be made: " + error.message());
  const fs::path probe = directory / ".corbot-probe";
  write_file(probe, "");
  fs::remove(probe, error);
  for (const char* earlier : {kAnimation, kGantt, kCamera}) fs::remove(directory / earlier, error);
}

std::vector<fs::path> write_pictures(const fs::path& directory, const RunPictures& pictures) {
  std::vector<fs::path> written;
  const auto write = [&](const char* name, std::string_view content) {
    if (content.empty()) return;
    write_file(directory / name, content);
    written.push_back(directory / name);
  };
  if (pictures.record) write(kAnimation, cell_animation(pictures.cell, *pictures.record));
  write(kGantt, gantt_svg(pictures.end.history));
  const auto& jpeg = pictures.end.camera_jpeg;
  write(kCamera, {reinterpret_cast<const char*>(jpeg.data()), jpeg.size()});
  return written;
}

}  // namespace corbot::cli
