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
  std::string who;         ///< name given with Acquire; empty: the public reference
  std::string from;        ///< address of the caller's connection
  std::string call;        ///< operation and arguments, as in IDL: "Drive(0, 20, 90)"
  std::uint64_t ticket{};  ///< 0: none
  std::string outcome;     ///< "ok", or the exception and its reason
  bool is_refusal{false};  ///< of a call that nobody with control made, and that did nothing
};

/// The audit log of one robot: DIRECTORY/NAME.audit, mode 0600, one JSON object a line, the newest last; kFiles of
/// kLargest bytes, see AuditFile. A line that is incomplete, since its writer ended meanwhile, is followed by a note.
/// Thread-safe; a call is never held up by
/// the disk: a thread of its own writes, and where it falls behind by kQueued entries the oldest of them are dropped.
/// Of calls that are refused over and over most are left out, see RefusalBudget; `left_out` in the next says how many.
/// Not real-time safe.
class AuditLog {
 public:
  static constexpr std::size_t kLargest = 1 << 20;
  static constexpr std::size_t kFiles = 8;
  static constexpr std::size_t kQueued = 8192;

  using Warn = std::function<void(const std::string&)>;

  /// Makes the directory, mode 0700. Throws std::runtime_error with the reason when the file cannot be opened. `warn` is
  /// called from the thread, once, when an entry could not be written or was dropped.
  AuditLog(const std::filesystem::path& directory, const std::string& robot, Warn warn,
           std::size_t largest = kLargest);
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;
  /// Writes what is queued.
  ~AuditLog();

  void record(const AuditEntry& entry) noexcept;
  /// How an accepted motion has ended: "done", "stopped", "failed: ..."
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
