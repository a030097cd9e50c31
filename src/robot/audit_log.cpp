// SPDX-License-Identifier: Apache-2.0
#include "robot/audit_log.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/async.h>
#include <spdlog/sinks/rotating_file_sink.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

namespace corbot {
namespace {

std::string utc_now() {
  const auto now = std::chrono::system_clock::now();
  const auto whole = std::chrono::time_point_cast<std::chrono::seconds>(now);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now - whole).count();
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(whole), ms);
}

/// In ASCII, whatever the texts are.
std::string to_line(const nlohmann::ordered_json& entry) {
  return entry.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

/// Says once, from the writing thread, that the log is incomplete.
class Incomplete {
 public:
  Incomplete(AuditLog::Warn warn, std::string file) : warn_(std::move(warn)), file_(std::move(file)) {}
  void report(const std::string& reason) {
    if (!std::exchange(has_warned_, true) && warn_)
      warn_(fmt::format("the audit log {} is incomplete: {}", file_, reason));
  }

 private:
  const AuditLog::Warn warn_;
  const std::string file_;
  bool has_warned_{false};
};

/// The files, and a look at what was dropped before this entry could be written.
class WatchedFiles final : public spdlog::sinks::sink {
 public:
  WatchedFiles(std::unique_ptr<spdlog::sinks::sink> files, spdlog::details::thread_pool& writer,
               std::shared_ptr<Incomplete> incomplete)
      : files_(std::move(files)), writer_(writer), incomplete_(std::move(incomplete)) {}
  void log(const spdlog::details::log_msg& entry) override {
    files_->log(entry);
    if (writer_.overrun_counter() > 0)
      incomplete_->report("entries were dropped, they came faster than they could be written");
  }
  void flush() override { files_->flush(); }
  void set_pattern(const std::string& pattern) override { files_->set_pattern(pattern); }
  void set_formatter(std::unique_ptr<spdlog::formatter> formatter) override {
    files_->set_formatter(std::move(formatter));
  }

 private:
  const std::unique_ptr<spdlog::sinks::sink> files_;
  spdlog::details::thread_pool& writer_;  // whose thread calls this
  const std::shared_ptr<Incomplete> incomplete_;
};

}  // namespace

AuditLog::AuditLog(const std::filesystem::path& directory, const std::string& robot, Warn warn,
                   std::size_t largest)
    : file_(directory / (robot + ".audit")) {
  const auto incomplete = std::make_shared<Incomplete>(std::move(warn), file_.string());
  try {
    if (std::filesystem::create_directories(directory))
      std::filesystem::permissions(directory, std::filesystem::perms::owner_all);
    spdlog::file_event_handlers handlers;
    handlers.after_open = [](const spdlog::filename_t&, std::FILE* file) {
      (void)::fchmod(::fileno(file), 0600);
    };
    auto files = std::make_unique<spdlog::sinks::rotating_file_sink_mt>(file_.string(), largest, kFiles - 1,
                                                                        false, handlers);
    writer_ = std::make_shared<spdlog::details::thread_pool>(kQueued, 1);
    auto sink = std::make_shared<WatchedFiles>(std::move(files), *writer_, incomplete);
    log_ = std::make_shared<spdlog::async_logger>("audit", std::move(sink), writer_,
                                                  spdlog::async_overflow_policy::overrun_oldest);
  } catch (const std::exception& error) {  // of spdlog or of std::filesystem
    throw std::runtime_error(
        fmt::format("the audit log {} cannot be written: {}", file_.string(), error.what()));
  }
  log_->set_error_handler([incomplete](const std::string& reason) { incomplete->report(reason); });
  log_->set_pattern("%v");
  log_->flush_on(spdlog::level::info);
}

AuditLog::~AuditLog() {
  writer_.reset();  // its thread writes what is queued, and has ended before the log goes
}

void AuditLog::write(const std::function<std::string()>& line) noexcept {
  try {
    log_->info("{}", line());
  } catch (const std::exception&) {
    // Memory is short: the call is worth more than its entry.
  }
}

void AuditLog::record(const AuditEntry& entry) noexcept {
  std::uint64_t left_out = 0;
  if (entry.outcome != "ok") {
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
