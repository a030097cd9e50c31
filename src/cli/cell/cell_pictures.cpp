// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_pictures.h"

#include <cerrno>
#include <fstream>
#include <string>
#include <string_view>

#include "cell/pictures/cell_animation.h"
#include "cell/scene_record.h"
#include "client/failure.h"

namespace corbot::cli {
namespace {

namespace fs = std::filesystem;
using client::ExitCode;
using client::Failure;

void write_file(const fs::path& path, std::string_view text) {
  errno = 0;
  std::ofstream file(path);
  if (!(file << text).flush()) throw client::system_failure(path, errno);
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
}

void write_pictures(const fs::path& directory, const cell::CellConfig& cell) {
  if (!cell.scene) return;
  const fs::path file = cell::scene_record_file(cell.state_directory);
  std::ifstream record(file);
  if (!record)
    throw Failure(ExitCode::kInternal, file.string() + ": the scene has left no record of the run");
  write_file(directory / "cell.svg", cell_animation(cell, cell::read_scene_record(record)));
}

}  // namespace corbot::cli
