// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ucontext.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

// A stateless, exhaustive model checker for a few threads over a few atomic variables and plain cells.
//
// The explorer runs every execution that the C++20 memory model allows for the given threads, each exactly
// once. The threads use relaxed, acquire and release loads and stores. This is the release-acquire fragment
// of RC11: coherence, and happens-before through release stores read by acquire loads. It has no
// read-modify-writes, no fences and no seq_cst. The stores that the loads read determine such an execution.
// The explorer therefore chooses these stores, not an order of steps. A load may return any executed store
// that coherence and happens-before do not hide from its thread. Or it waits until another thread has
// executed a further store to that variable, and chooses again. There is no bound on pre-emptions or
// staleness; the programs are written with bounds (records, attempts).
//
// Two kinds of execution are left out. In the first, a load reads a store that depends on that same load:
// cycles of program order and reads-from. No compiler or machine is known to show them for dependent stores.
// In the second, a variable has several writers, whose modification order would have to be chosen, too. The
// explorer refuses such variables.
//
// Plain cells are checked for data races with vector clocks. They need no choice of their own: whether two
// accesses are ordered does not depend on which is executed first.

namespace corbot::model {

inline constexpr std::size_t kMaxThreads = 4;
inline constexpr std::size_t kMaxLocations = 24;

/// How much of each thread's past is known.
using Clock = std::array<std::uint32_t, kMaxThreads>;
/// Per atomic variable, the oldest store that may still be read.
using View = std::array<std::uint32_t, kMaxLocations>;

struct Outcome {
  std::uint64_t executions{0};  ///< complete ones
  std::uint64_t infeasible{0};  ///< choices abandoned: a load waited for a store that never came
  std::string failure;          ///< of the first failing execution; empty when there is none
};

class Explorer {
 public:
  /// `begin` makes a fresh program (its atomics register themselves) and returns the threads' bodies; `end`
  /// is called after each complete execution. Both and the bodies may call fail().
  /// Stops at the first failure.
  using Bodies = std::vector<std::function<void()>>;
  Outcome explore(const std::function<Bodies()>& begin, const std::function<void()>& end);

  /// The one that is exploring; what the model's atomics talk to.
  static Explorer& current() { return *current_; }

  /// Ends the execution with an error. Does not return when called by a thread of the program.
  void fail(const std::string& text);

  std::size_t add_location(std::uint64_t initial);
  std::uint64_t load(std::size_t location, std::memory_order order);
  void store(std::size_t location, std::uint64_t value, std::memory_order order);

  /// State of one plain cell, for race detection.
  struct Accesses {
    std::size_t writer{kMaxThreads};  ///< kMaxThreads: the initial value, ordered before everything
    std::uint32_t written{0};
    Clock read{};
  };
  void read_cell(Accesses& cell);
  void write_cell(Accesses& cell);

 private:
  struct Store {
    std::uint64_t value;
    View view;
    Clock clock;
  };
  struct Location {
    std::vector<Store> history;
    std::size_t writer{kMaxThreads};
  };
  struct Thread {
    View view{};
    Clock clock{};
    bool finished{false};
    bool waiting{false};
    std::size_t location{0};  ///< waited for
    std::size_t known{0};     ///< stores to it when the wait began
    ucontext_t context{};
    std::vector<char> stack;
  };
  struct Choice {
    std::size_t taken;
    std::size_t count;
  };

  std::size_t choose(std::size_t count);
  [[nodiscard]] bool others_can_run() const;
  [[nodiscard]] bool runnable(const Thread& thread) const;
  bool run_once(const Bodies& bodies);
  bool next_path();
  static void enter();

  inline static Explorer* current_ = nullptr;
  std::vector<Choice> path_;
  std::size_t depth_{0};
  std::vector<Location> locations_;
  std::array<Thread, kMaxThreads> threads_;
  std::size_t thread_count_{0};
  std::size_t running_{kMaxThreads};  ///< kMaxThreads: none, the program is being made or judged
  const Bodies* bodies_{nullptr};
  ucontext_t scheduler_{};
  std::string failure_;
};

/// Explores a Program: default-constructed for each execution, with kThreads, run(thread) and finish().
template <class Program>
Outcome explore() {
  Explorer explorer;
  // Not destroyed while contexts of an abandoned execution may still refer to it; programs are plain data.
  std::vector<Program> program;
  program.reserve(1);
  return explorer.explore(
      [&] {
        program.clear();
        program.emplace_back();
        Explorer::Bodies bodies;
        for (std::size_t i = 0; i < Program::kThreads; ++i)
          bodies.push_back([&program, i] { program[0].run(i); });
        return bodies;
      },
      [&] { program[0].finish(); });
}

inline void require(bool condition, const char* text) {
  if (!condition) Explorer::current().fail(text);
}

}  // namespace corbot::model
