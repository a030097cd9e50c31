// SPDX-License-Identifier: Apache-2.0
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "cached_queue.h"
#include "corbot/channel/ring.h"
#include "corbot/motion/command.h"

// Compares the command ring with its peers: the same record, the same capacity, in turn within one run,
// medians over many turns. Usage: ring_bench [turns]. Three measures:
// `push+pop`: one thread, one record in and out: instructions only;
// `round trip`: two threads on two CPUs, a record there and one back: latency;
// `throughput`: two threads on two CPUs, as fast as they go.
// A turn is shorter than a scheduler's time slice, so that on a busy machine most turns are undisturbed. A
// queue's ratio is the median over the turns of (its time / the ring's time in the same turn): above 1, the
// ring is faster.

namespace corbot::bench {
namespace {

constexpr std::size_t kCapacity = 64;
using Clock = std::chrono::steady_clock;

/// The ring as its two processes use it: one end each. The ends lie apart, as in two processes.
struct Own {
  static constexpr const char* kName = "corbot::Ring";
  std::unique_ptr<Ring<Command, kCapacity>> ring = std::make_unique<Ring<Command, kCapacity>>();
  alignas(128) RingProducer<RingSlots<Command, kCapacity>> producer{*ring};
  alignas(128) RingConsumer<RingSlots<Command, kCapacity>> consumer{*ring};
  bool push(const Command& command) { return producer.push(command); }
  bool pop(Command& command) { return consumer.pop(command) == PopResult::kOk; }
};

struct Boost {
  static constexpr const char* kName = "boost::lockfree::spsc_queue";
  using Queue = boost::lockfree::spsc_queue<Command, boost::lockfree::capacity<kCapacity>>;
  std::unique_ptr<Queue> queue = std::make_unique<Queue>();
  bool push(const Command& command) { return queue->push(command); }
  bool pop(Command& command) { return queue->pop(command); }
};

struct Cached {
  static constexpr const char* kName = "cached-index queue (rigtorp style)";
  std::unique_ptr<CachedQueue<Command, kCapacity>> queue =
      std::make_unique<CachedQueue<Command, kCapacity>>();
  bool push(const Command& command) { return queue->push(command); }
  bool pop(Command& command) { return queue->pop(command); }
};

void pin(unsigned cpu) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(cpu, &set);
  if (pthread_setaffinity_np(pthread_self(), sizeof(set), &set) != 0) std::perror("pthread_setaffinity_np");
}

double nanoseconds_each(Clock::time_point begin, std::uint64_t count) {
  return std::chrono::duration<double, std::nano>(Clock::now() - begin).count() / static_cast<double>(count);
}

[[noreturn]] void wrong(const char* name) {
  std::fprintf(stderr, "%s: records out of order\n", name);
  std::exit(1);
}

struct PushPop {
  static constexpr const char* kTitle = "push+pop, one thread";
  template <class Queue>
  static double run() {
    constexpr std::uint64_t kCount = 20'000;
    Queue queue;
    Command in{};
    Command out{};
    const auto begin = Clock::now();
    for (std::uint64_t i = 1; i <= kCount; ++i) {
      in.id = i;
      if (!queue.push(in) || !queue.pop(out) || out.id != i) wrong(Queue::kName);
    }
    return nanoseconds_each(begin, kCount);
  }
};

struct RoundTrip {
  static constexpr const char* kTitle = "round trip, two threads";
  template <class Queue>
  static double run() {
    constexpr std::uint64_t kCount = 2'000;
    Queue there;
    Queue back;
    std::atomic<bool> ready{false};
    std::thread echo([&] {
      pin(1);
      Command command{};
      ready.store(true);
      for (std::uint64_t i = 0; i < kCount; ++i) {
        while (!there.pop(command)) {
        }
        while (!back.push(command)) {
        }
      }
    });
    while (!ready.load()) {
    }
    Command in{};
    Command out{};
    const auto begin = Clock::now();
    for (std::uint64_t i = 1; i <= kCount; ++i) {
      in.id = i;
      while (!there.push(in)) {
      }
      while (!back.pop(out)) {
      }
      if (out.id != i) wrong(Queue::kName);
    }
    const double each = nanoseconds_each(begin, kCount);
    echo.join();
    return each;
  }
};

struct Throughput {
  static constexpr const char* kTitle = "throughput, two threads";
  template <class Queue>
  static double run() {
    constexpr std::uint64_t kCount = 10'000;
    Queue queue;
    std::atomic<bool> ready{false};
    std::thread producer([&] {
      pin(1);
      Command in{};
      ready.store(true);
      for (std::uint64_t i = 1; i <= kCount; ++i) {
        in.id = i;
        while (!queue.push(in)) {
        }
      }
    });
    while (!ready.load()) {
    }
    Command out{};
    const auto begin = Clock::now();
    for (std::uint64_t i = 1; i <= kCount; ++i) {
      while (!queue.pop(out)) {
      }
      if (out.id != i) wrong(Queue::kName);
    }
    const double each = nanoseconds_each(begin, kCount);
    producer.join();
    return each;
  }
};

double quantile(std::vector<double> values, double fraction) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Contender {
  const char* name;
  std::function<double()> run;
};

/// In each turn every contender once, beginning with another one each time.
void compare(const char* title, const std::vector<Contender>& contenders, int turns) {
  std::vector<std::vector<double>> times(contenders.size());
  for (const Contender& contender : contenders) contender.run();  // warm-up
  for (int turn = 0; turn < turns; ++turn) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      const std::size_t index = (i + static_cast<std::size_t>(turn)) % contenders.size();
      times[index].push_back(contenders[index].run());
    }
  }
  std::printf("%s\n", title);
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    std::vector<double> ratios;
    for (std::size_t turn = 0; turn < times[i].size(); ++turn)
      ratios.push_back(times[i][turn] / times[0][turn]);
    std::printf("  %-36s %8.1f ns   ratio %.2f   (fastest tenth below %.1f ns)\n", contenders[i].name,
                quantile(times[i], 0.5), quantile(ratios, 0.5), quantile(times[i], 0.1));
  }
}

template <class Measure>
void compare_all(int turns) {
  compare(Measure::kTitle,
          {{Own::kName, Measure::template run<Own>},
           {Boost::kName, Measure::template run<Boost>},
           {Cached::kName, Measure::template run<Cached>}},
          turns);
}

int run(int turns) {
  if (std::thread::hardware_concurrency() < 2) {
    std::puts("needs two CPUs");
    return 1;
  }
  pin(0);
  std::printf("%zu bytes a record, capacity %zu, %d turns\n", sizeof(Command), kCapacity, turns);
  compare_all<PushPop>(turns);
  compare_all<RoundTrip>(turns);
  compare_all<Throughput>(turns);
  return 0;
}

}  // namespace
}  // namespace corbot::bench

int main(int argc, char** argv) { return corbot::bench::run(argc > 1 ? std::atoi(argv[1]) : 1001); }
