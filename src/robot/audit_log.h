// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "robot/refusal_budget.h"

namespace spdlog {
class logger;
namespace details {
class thread_pool;
}
}  // namespace spdlog

namespace corbot {

/// One call that moved the arm, changed how it moves, stopped it or took control of it.
struct AuditEntry {
  std::string who;         ///< name given with Acquire; "": the public reference
  std::string from;        ///< address of the caller's connection
  std::string call;        ///< operation and arguments, as in IDL: "Drive(0, 20, 90)"
  std::uint64_t ticket{};  ///< 0: none
  std::string outcome;     ///< "ok", or the exception and its reason
  bool is_refusal{false};  ///< a refused call without control, which had no effect
};

/// The audit log of one robot: DIRECTORY/NAME.audit, mode 0600, with one JSON object a line, the newest last.
/// The log has kFiles files of kLargest bytes, see AuditFile. If a writer ended in the middle of a line, the
/// log ends the line and adds a note. A separate thread writes, so a call never waits for the disk. If that
/// thread falls behind by kQueued entries, the oldest entries are dropped. The log omits most calls of a
/// client that is refused repeatedly, see RefusalBudget. `left_out` in the next entry says how many.
/// Thread-safe; not real-time safe.
class AuditLog {
 public:
  static constexpr std::size_t kLargest = 1 << 20;
  static constexpr std::size_t kFiles = 8;
  static constexpr std::size_t kQueued = 8192;

  using Warn = std::function<void(const std::string&)>;

  /// Creates the directory with mode 0700. Throws std::runtime_error with the reason if the file cannot be
  /// opened. The writing thread calls `warn` once if an entry was dropped or could not be written.
  AuditLog(const std::filesystem::path& directory, const std::string& robot, Warn warn,
           std::size_t largest = kLargest);
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;
  /// Writes the queued entries.
  ~AuditLog();

  void record(const AuditEntry& entry) noexcept;
  /// Records the end of an accepted motion: "done", "stopped", "failed: ..."
  void record_end(std::uint64_t ticket, const std::string& end) noexcept;
  [[nodiscard]] const std::filesystem::path& file() const noexcept { return file_; }

 private:
  void write(const std::function<std::string()>& line) noexcept;

  std::filesystem::path file_;
  std::mutex mutex_;  // of the budget
  RefusalBudget refusals_;
  std::shared_ptr<spdlog::details::thread_pool> writer_;
  std::shared_ptr<spdlog::logger> log_;
};

}  // namespace corbot
