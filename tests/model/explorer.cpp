// SPDX-License-Identifier: Apache-2.0
#include "explorer.h"

#include <algorithm>
#include <stdexcept>

namespace corbot::model {
namespace {

constexpr std::size_t kStackBytes = 256 * 1024;

bool acquires(std::memory_order order) { return order == std::memory_order_acquire; }
bool releases(std::memory_order order) { return order == std::memory_order_release; }

template <class Vector>
void join(Vector& into, const Vector& from) {
  for (std::size_t i = 0; i < into.size(); ++i) into[i] = std::max(into[i], from[i]);
}

}  // namespace

Outcome Explorer::explore(const std::function<Bodies()>& begin, const std::function<void()>& end) {
  Outcome outcome;
  current_ = this;
  path_.clear();
  do {
    depth_ = 0;
    failure_.clear();
    locations_.clear();
    running_ = kMaxThreads;
    const Bodies bodies = begin();
    const bool complete = run_once(bodies);
    if (complete && failure_.empty()) end();
    outcome.executions += complete;
    outcome.infeasible += !complete && failure_.empty();
    if (!failure_.empty()) {
      outcome.failure = failure_;
      break;
    }
  } while (next_path());
  current_ = nullptr;
  return outcome;
}

/// Depth first: the last choice that has an alternative takes it.
bool Explorer::next_path() {
  while (!path_.empty() && path_.back().taken + 1 == path_.back().count) path_.pop_back();
  if (path_.empty()) return false;
  ++path_.back().taken;
  return true;
}

std::size_t Explorer::choose(std::size_t count) {
  if (count == 1) return 0;
  if (depth_ == path_.size()) path_.push_back({0, count});
  const Choice& choice = path_[depth_++];
  if (choice.count != count)
    throw std::logic_error("the program does not repeat itself: it is not deterministic");
  return choice.taken;
}

bool Explorer::runnable(const Thread& thread) const {
  if (thread.finished) return false;
  return !thread.waiting || locations_[thread.location].history.size() > thread.known;
}

bool Explorer::others_can_run() const {
  for (std::size_t i = 0; i < thread_count_; ++i) {
    if (i != running_ && runnable(threads_[i])) return true;
  }
  return false;
}

void Explorer::enter() {
  Explorer& self = current();
  const std::size_t index = self.running_;
  (*self.bodies_)[index]();
  self.threads_[index].finished = true;
  swapcontext(&self.threads_[index].context, &self.scheduler_);
}

/// True when every thread came to its end.
bool Explorer::run_once(const Bodies& bodies) {
  bodies_ = &bodies;
  thread_count_ = bodies.size();
  for (std::size_t i = 0; i < thread_count_; ++i) {
    Thread& thread = threads_[i];
    thread.view = {};
    thread.clock = {};
    thread.clock[i] = 1;
    thread.finished = thread.waiting = false;
    thread.stack.resize(kStackBytes);
    getcontext(&thread.context);
    thread.context.uc_stack.ss_sp = thread.stack.data();
    thread.context.uc_stack.ss_size = thread.stack.size();
    thread.context.uc_link = nullptr;
    makecontext(&thread.context, &Explorer::enter, 0);
  }
  for (;;) {
    std::size_t next = 0;
    while (next < thread_count_ && !runnable(threads_[next])) ++next;
    if (next == thread_count_) break;
    running_ = next;
    swapcontext(&scheduler_, &threads_[next].context);
    running_ = kMaxThreads;
    if (!failure_.empty()) return false;
  }
  return std::all_of(threads_.begin(), threads_.begin() + static_cast<std::ptrdiff_t>(thread_count_),
                     [](const Thread& thread) { return thread.finished; });
}

void Explorer::fail(const std::string& text) {
  if (failure_.empty()) failure_ = text;
  // The thread stays where it is, for good: it may be inside a noexcept function, so nothing can be thrown
  // through it.
  if (running_ != kMaxThreads) swapcontext(&threads_[running_].context, &scheduler_);
}

std::size_t Explorer::add_location(std::uint64_t initial) {
  if (locations_.size() == kMaxLocations) throw std::logic_error("too many atomic variables for the model");
  locations_.emplace_back().history.push_back({initial, {}, {}});
  return locations_.size() - 1;
}

std::uint64_t Explorer::load(std::size_t location, std::memory_order order) {
  if (order != std::memory_order_relaxed && !acquires(order))
    fail("memory order that the model does not know");
  std::vector<Store>& history = locations_[location].history;
  if (running_ == kMaxThreads) return history.back().value;  // after the end: the last value
  Thread& self = threads_[running_];
  std::size_t oldest = self.view[location];
  for (;;) {
    const std::size_t readable = history.size() - oldest;
    const bool own = locations_[location].writer == running_;
    const bool may_wait = !own && others_can_run();
    // Newest first, waiting last. Nothing readable: only after a wait, and then there is at least one.
    const std::size_t chosen = choose(readable + (may_wait ? 1 : 0));
    if (chosen < readable) {
      const std::size_t index = history.size() - 1 - chosen;
      self.view[location] = static_cast<std::uint32_t>(index);
      if (acquires(order)) {
        join(self.view, history[index].view);
        join(self.clock, history[index].clock);
      }
      return history[index].value;
    }
    oldest = history.size();  // what was there has been passed over; only something newer will do
    self.waiting = true;
    self.location = location;
    self.known = history.size();
    swapcontext(&self.context, &scheduler_);
    self.waiting = false;
  }
}

void Explorer::store(std::size_t location, std::uint64_t value, std::memory_order order) {
  if (order != std::memory_order_relaxed && !releases(order))
    fail("memory order that the model does not know");
  Location& target = locations_[location];
  if (running_ == kMaxThreads) {  // by the thread that makes the program: ordered before all threads
    target.history.assign(1, {value, {}, {}});
    return;
  }
  if (target.writer != kMaxThreads && target.writer != running_) fail("a variable with two writers");
  target.writer = running_;
  Thread& self = threads_[running_];
  self.view[location] = static_cast<std::uint32_t>(target.history.size());
  // A relaxed store passes nothing on to its reader. A release store passes on all that its thread knows.
  Store entry{value, {}, {}};
  if (releases(order)) {
    entry.view = self.view;
    entry.clock = self.clock;
  }
  target.history.push_back(entry);
  ++self.clock[running_];  // what follows is not covered by this store's release
}

void Explorer::read_cell(Accesses& cell) {
  if (running_ == kMaxThreads) return;
  Thread& self = threads_[running_];
  if (cell.writer != kMaxThreads && cell.writer != running_ && cell.written > self.clock[cell.writer]) {
    fail("data race: a cell is read while it is being written");
  }
  cell.read[running_] = self.clock[running_];
}

void Explorer::write_cell(Accesses& cell) {
  if (running_ == kMaxThreads) return;
  Thread& self = threads_[running_];
  if (cell.writer != kMaxThreads && cell.writer != running_ && cell.written > self.clock[cell.writer]) {
    fail("data race: a cell is written by two threads");
  }
  for (std::size_t i = 0; i < kMaxThreads; ++i) {
    if (i != running_ && cell.read[i] > self.clock[i])
      fail("data race: a cell is written while it is being read");
  }
  cell.writer = running_;
  cell.written = self.clock[running_];
}

}  // namespace corbot::model
