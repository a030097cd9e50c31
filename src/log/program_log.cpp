// SPDX-License-Identifier: Apache-2.0
#include "log/program_log.h"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <memory>
#include <mutex>
#include <string_view>

#include "log/line_output.h"

namespace corbot {
namespace {

class StandardError final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    std::string_view text(line.data(), line.size());
    text.remove_suffix(text.ends_with('\n') ? 1 : 0);
    output_.write(text);
  }
  void flush_() override {}

 private:
  LineOutput output_{STDERR_FILENO};
};

}  // namespace

void log_without_waiting(const std::string& program) {
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(program, std::make_shared<StandardError>()));
}

}  // namespace corbot
