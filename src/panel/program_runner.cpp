// SPDX-License-Identifier: Apache-2.0
#include "panel/program_runner.h"

#include <utility>

#include "client/explain.h"

namespace corbot::panel {

namespace {
using client::printable;
using nlohmann::json;
}  // namespace

ProgramRunner::~ProgramRunner() {
  cancel();
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    wake_.notify_all();
  }
  thread_.join();
}

bool ProgramRunner::start(client::Program program) {
  const std::lock_guard lock(mutex_);
  if (running_) return false;
  running_ = true;
  cancelled_ = false;
  state_ = {{"name", printable(program.name)},
            {"state", "runs"},
            {"line", 0},
            {"statement", ""},
            {"index", 0},
            {"progress", 0.0},
            {"text", ""},
            {"remark", ""},
            {"count", program.statements.size()}};
  program_ = std::move(program);
  wake_.notify_all();
  return true;
}

void ProgramRunner::cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  if (performer_) performer_->begin_cancel();
}

bool ProgramRunner::is_running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

json ProgramRunner::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void ProgramRunner::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [&] { return ending_ || running_; });
    if (!running_) return;
    const client::Program program = std::move(program_);
    lock.unlock();
    try {
      carry_out(program);
      finish("done", "");
    } catch (const client::Failure& failure) {
      const bool was_stopped = failure.code() == client::ExitCode::kStopped;
      finish(was_stopped ? "stopped" : "failed", failure.what());
    } catch (const std::exception& error) {
      finish("failed", error.what());
    }
    lock.lock();
  }
}

void ProgramRunner::carry_out(const client::Program& program) {
  std::unique_ptr<Performer> made = calls_.connect();
  Performer& performer = *made;
  {
    const std::lock_guard lock(mutex_);
    performer_ = std::move(made);
    if (cancelled_) performer_->begin_cancel();
  }
  client::carry_out(program, [&](std::size_t index, const client::Statement& statement) {
    {
      const std::lock_guard lock(mutex_);
      state_["index"] = index;
      state_["line"] = statement.line;
      state_["statement"] = printable(statement.text);
      state_["progress"] = 0.0;
      // A setting starts no motion, so that a client does not refuse it after a Stop.
      if (cancelled_) throw client::explain(Corbot::Stopped("interrupted"));
    }
    const std::string remark = performer.perform(statement.request, [&](double progress) {
      const std::lock_guard lock(mutex_);
      state_["progress"] = progress;
    });
    const std::lock_guard lock(mutex_);
    if (!remark.empty()) state_["remark"] = "line " + std::to_string(statement.line) + ": " + remark;
  });
}

void ProgramRunner::finish(const char* state, const std::string& text) {
  bool stops_again = false;
  {
    const std::lock_guard lock(mutex_);
    performer_.reset();
    stops_again = cancelled_ && std::string_view(state) == "failed";
  }
  if (stops_again) calls_.stop();
  {
    const std::lock_guard lock(mutex_);
    state_["state"] = state;
    state_["text"] = text;
    running_ = false;
  }
  calls_.ended();
}

}  // namespace corbot::panel
