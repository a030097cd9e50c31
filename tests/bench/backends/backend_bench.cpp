// SPDX-License-Identifier: Apache-2.0
// Measures the calls of a backend in a cycle: write, read, health, cause and times. Its own thread is busy
// with an emulated device meanwhile. The peer is a backend that only stores the frame; blocks of both
// alternate.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "config/load_profile.h"
#include "contract/device_fixture.h"
#include "contract/driver.h"
#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kBlocks = 200;
constexpr std::size_t kCyclesABlock = 500;
constexpr auto kPause = std::chrono::microseconds(10);  // a hundred times the rate of the loop

/// The least that a backend can do.
class NoBackend final : public Backend {
 public:
  void open(const ServoFrame&) override {}
  void close() noexcept override {}
  void write(const ServoFrame& frame) noexcept override { last_ = frame; }
  [[nodiscard]] ServoFeedback read() noexcept override { return {}; }
  [[nodiscard]] BackendHealth health() const noexcept override { return BackendHealth::kOpen; }
  [[nodiscard]] const char* name() const noexcept override { return "none"; }

 private:
  ServoFrame last_{};
};

/// Nanoseconds of each exchange of one block.
void exchange(Backend& backend, ServoFrame& frame, std::vector<double>& times_ns) {
  for (std::size_t i = 0; i < kCyclesABlock; ++i) {
    const auto begin = Clock::now();
    ++frame.cycle;
    frame.time_ns = begin.time_since_epoch().count();
    backend.write(frame);
    const ServoFeedback feedback = backend.read();
    const BackendHealth health = backend.health();
    const DeviceCause cause = backend.cause();
    const BackendTimes times = backend.times();
    const auto end = Clock::now();
    asm volatile("" : : "g"(&feedback), "g"(health), "g"(cause), "g"(&times) : "memory");
    times_ns.push_back(std::chrono::duration<double, std::nano>(end - begin).count());
    while (Clock::now() < end + kPause) {
    }
  }
}

void print(const std::string& name, std::vector<double> times_ns) {
  std::sort(times_ns.begin(), times_ns.end());
  const auto at = [&](double share) {
    return times_ns[static_cast<std::size_t>(share * static_cast<double>(times_ns.size() - 1))];
  };
  fmt::print("{:<18} median {:5.0f}  p99 {:5.0f}  p99.9 {:6.0f}  max {:8.0f} ns\n", name, at(0.5), at(0.99),
             at(0.999), at(1.0));
}

Profile profile_with(const std::string& backend) {
  std::ifstream from(CORBOT_TIMED_PROFILE);
  const std::string all{std::istreambuf_iterator<char>(from), {}};
  return parse_profile(all.substr(0, all.find("[backend]")) + backend, "bench");
}

void measure(const DeviceFixtureKind& kind) {
  const std::string directory = CORBOT_SCRATCH_DIR + ("/" + unique_name("backend_bench"));
  fs::create_directories(directory);
  const ArmModel arm = profile_with("[backend]\nkind = \"loopback\"\n").arm;
  auto fixture = kind.make(arm, directory);
  if (const std::string missing = fixture->missing(); !missing.empty()) {
    fmt::print("{:<18} skipped: {}\n", kind.name, missing);
    fs::remove_all(directory);
    return;
  }
  fixture->set_up();
  EmergencyStop stop;
  const auto backend = fixture->make(profile_with(fixture->backend_section()), stop);
  NoBackend none;
  ServoFrame frame = Driver::frame(arm, {});
  backend->open(frame);
  std::vector<double> with_ns;
  std::vector<double> without_ns;
  with_ns.reserve(kBlocks * kCyclesABlock);
  without_ns.reserve(kBlocks * kCyclesABlock);
  for (std::size_t block = 0; block < kBlocks; ++block) {
    exchange(*backend, frame, with_ns);
    exchange(none, frame, without_ns);
  }
  const bool good = backend->health() == BackendHealth::kOpen;
  backend->close();
  print(kind.name, with_ns);
  print("  none beside it", without_ns);
  if (!good) fmt::print("{}: the device was lost meanwhile\n", kind.name);
  fixture.reset();
  fs::remove_all(directory);
}

}  // namespace
}  // namespace corbot::test

int main() {
  for (const corbot::test::DeviceFixtureKind& kind : corbot::test::all_fixtures())
    corbot::test::measure(kind);
  return 0;
}
