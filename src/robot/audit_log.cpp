// SPDX-License-Identifier: Apache-2.0
#include "robot/audit_log.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/async.h>
#include <spdlog/sinks/sink.h>

#include <chrono>
#include <exception>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "robot/audit_file.h"

namespace corbot {
namespace {

std::string utc_now() {
  const auto now = std::chrono::system_clock::now();
  const auto whole = std::chrono::time_point_cast<std::chrono::seconds>(now);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now - whole).count();
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(whole), ms);
}

/// Returns the entry as one line of ASCII, whatever its texts contain.
std::string to_line(const nlohmann::ordered_json& entry) {
  return entry.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

/// Reports a fault of the log once, from the writing thread.
class Warning {
 public:
  Warning(AuditLog::Warn warn, std::string file) : warn_(std::move(warn)), file_(std::move(file)) {}
  /// `what` describes the fault.
  void report(const std::string& what) {
    if (!std::exchange(has_warned_, true) && warn_) warn_(fmt::format("the audit log {} {}", file_, what));
  }

 private:
  const AuditLog::Warn warn_;
  const std::string file_;
  bool has_warned_{false};
};

/// The log's sink: writes the files and reports entries that were dropped before.
class AuditSink final : public spdlog::sinks::sink {
 public:
  AuditSink(AuditFile file, spdlog::details::thread_pool& writer, std::shared_ptr<Warning> incomplete)
      : file_(std::move(file)), writer_(writer), incomplete_(std::move(incomplete)) {
    try {
      mark_torn_line();
    } catch (const std::system_error&) {
      // The first entry tries again.
    }
  }
  void log(const spdlog::details::log_msg& entry) override {
    mark_torn_line();
    file_.append({entry.payload.data(), entry.payload.size()});
    if (writer_.overrun_counter() > 0)
      incomplete_->report("is incomplete: entries were dropped, they came faster than they could be written");
  }
  void flush() override {}
  void set_pattern(const std::string&) override {}
  void set_formatter(std::unique_ptr<spdlog::formatter>) override {}

 private:
  /// Ends an incomplete line that a servant or a machine left when it ended during a write.
  void mark_torn_line() {
    if (file_.is_torn())
      file_.append(to_line({{"time", utc_now()}, {"note", "the line before is incomplete"}}));
  }

  AuditFile file_;
  spdlog::details::thread_pool& writer_;  // its thread calls this sink
  const std::shared_ptr<Warning> incomplete_;
};

}  // namespace

AuditLog::AuditLog(const std::filesystem::path& directory, const std::string& robot, Warn warn,
                   std::size_t largest)
    : file_(directory / (robot + ".audit")) {
  const auto grows = std::make_shared<Warning>(warn, file_.string());
  const auto incomplete = std::make_shared<Warning>(std::move(warn), file_.string());
  try {
    if (std::filesystem::create_directories(directory))
      std::filesystem::permissions(directory, std::filesystem::perms::owner_all);
    AuditFile file(file_, largest, kFiles, [grows](const std::string& what) { grows->report(what); });
    writer_ = std::make_shared<spdlog::details::thread_pool>(kQueued, 1);
    auto sink = std::make_shared<AuditSink>(std::move(file), *writer_, incomplete);
    log_ = std::make_shared<spdlog::async_logger>("audit", std::move(sink), writer_,
                                                  spdlog::async_overflow_policy::overrun_oldest);
  } catch (const std::exception& error) {  // from spdlog or std::filesystem
    throw std::runtime_error(
        fmt::format("the audit log {} cannot be written: {}", file_.string(), error.what()));
  }
  log_->set_error_handler(
      [incomplete](const std::string& reason) { incomplete->report("is incomplete: " + reason); });
}

AuditLog::~AuditLog() {
  writer_.reset();  // joins the writer, which first writes the queued entries
}

void AuditLog::write(const std::function<std::string()>& line) noexcept {
  try {
    log_->info("{}", line());
  } catch (const std::exception&) {
    // Without memory, the call matters more than its entry.
  }
}

void AuditLog::record(const AuditEntry& entry) noexcept {
  std::uint64_t left_out = 0;
  if (entry.is_refusal) {
    const std::lock_guard lock(mutex_);
    const auto taken = refusals_.take(RefusalBudget::Clock::now());
    if (!taken) return;
    left_out = *taken;
  }
  write([&] {
    nlohmann::ordered_json line{
        {"time", utc_now()}, {"who", entry.who}, {"from", entry.from}, {"call", entry.call}};
    if (entry.ticket != 0) line["ticket"] = entry.ticket;
    line["outcome"] = entry.outcome;
    if (left_out != 0) line["left_out"] = left_out;  // refused calls before this one
    return to_line(line);
  });
}

void AuditLog::record_end(std::uint64_t ticket, const std::string& end) noexcept {
  write([&] { return to_line({{"time", utc_now()}, {"ticket", ticket}, {"end", end}}); });
}

}  // namespace corbot
