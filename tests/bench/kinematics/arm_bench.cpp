// SPDX-License-Identifier: Apache-2.0
// Measures each family's forward and inverse kinematics, and all solutions at a pose. In the same run it
// measures the paper's equations for the Lynx 5, on the same arm (al5d) and the same poses.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "arm_vectors.h"
#include "corbot/kinematics/arm_kinematics.h"
#include "corbot/kinematics/path_form.h"
#include "corbot/kinematics/tool_pose.h"
#include "inverse_at_pitch.h"
#include "paper_equations.h"

namespace corbot {
namespace {

constexpr std::size_t kPoses = 1000;
constexpr double kPi = std::numbers::pi;
const paper::Arm kLynx{0.06731, 0.14605, 0.187325, 0.100, {0.0, kPi / 18, 0.0, -kPi / 4}};

struct Case {
  Kinematics arm;
  std::array<Joints, kPoses> joints{};
  std::array<Pose, kPoses> poses{};
  std::array<std::uint32_t, kPoses> numbers{};

  explicit Case(const std::string& name) {
    const test::ArmVectors vectors = test::arm_vectors(name);
    arm = Kinematics::recognise(joint_chain(vectors.table));
    std::mt19937_64 random(1751);
    for (std::size_t n = 0; n < kPoses; ++n) {
      for (std::size_t i = 0; i < arm.joint_count(); ++i) {
        joints[n][i] = std::uniform_real_distribution<double>(vectors.lower_q[i], vectors.upper_q[i])(random);
      }
      poses[n] = arm.forward(joints[n]);
      numbers[n] = arm.solution_of(joints[n]).value_or(0);
    }
  }
};

void forward_of(benchmark::State& state, const std::string& name) {
  const Case c(name);
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(c.arm.forward(c.joints[n]));
    n = (n + 1) % kPoses;
  }
}
void inverse_at(benchmark::State& state, const std::string& name) {
  const Case c(name);
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(c.arm.inverse(c.poses[n], c.numbers[n], c.joints[n]));
    n = (n + 1) % kPoses;
  }
}
void solutions_of(benchmark::State& state, const std::string& name) {
  const Case c(name);
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(c.arm.solutions(c.poses[n], c.joints[n], 1e-6));
    n = (n + 1) % kPoses;
  }
}
void jacobian_of(benchmark::State& state, const std::string& name) {
  const Case c(name);
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(c.arm.jacobian(c.joints[n]));
    n = (n + 1) % kPoses;
  }
}
/// One cell of a proof.
void stretch_of(benchmark::State& state, const std::string& name) {
  const Case c(name);
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(PathForm(c.arm, c.joints[n]).bound({0.1, 0.2, 0.1}, {}, 1e-3));
    n = (n + 1) % kPoses;
  }
}
void forward_of_paper(benchmark::State& state) {
  const Case c("al5d");
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(paper::forward(kLynx, c.joints[n]));
    n = (n + 1) % kPoses;
  }
}
void inverse_of_paper(benchmark::State& state) {
  const Case c("al5d");
  std::array<paper::Pose, kPoses> poses;
  for (std::size_t n = 0; n < kPoses; ++n) poses[n] = paper::forward(kLynx, c.joints[n]);
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(paper::inverse(kLynx, poses[n].position_m, poses[n].pitch_rad, c.numbers[n]));
    n = (n + 1) % kPoses;
  }
}
/// Measures the inverse that lines and arcs of four-axis arms need.
void inverse_at_a_pitch(benchmark::State& state) {
  const Case c("al5d");
  std::array<ToolPose, kPoses> poses;
  for (std::size_t n = 0; n < kPoses; ++n) poses[n] = tool_pose(c.arm, c.joints[n]);
  std::size_t n = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        test::inverse_at_pitch(c.arm, poses[n].position_m, poses[n].pitch_rad, c.numbers[n], c.joints[n]));
    n = (n + 1) % kPoses;
  }
}

}  // namespace
}  // namespace corbot

int main(int count, char** arguments) {
  benchmark::RegisterBenchmark("forward/paper", corbot::forward_of_paper);
  benchmark::RegisterBenchmark("inverse/paper", corbot::inverse_of_paper);
  benchmark::RegisterBenchmark("inverse_at_pitch/al5d", corbot::inverse_at_a_pitch);
  for (const std::string name : {"al5d", "al5d_wr", "so101", "scara_gx4", "cartesian_pppr",
                                 "cylindrical_rppr", "polar_rrp", "stanford", "puma560", "ur5e"}) {
    benchmark::RegisterBenchmark(("forward/" + name).c_str(), corbot::forward_of, name);
    benchmark::RegisterBenchmark(("jacobian/" + name).c_str(), corbot::jacobian_of, name);
    benchmark::RegisterBenchmark(("stretch/" + name).c_str(), corbot::stretch_of, name);
    benchmark::RegisterBenchmark(("inverse/" + name).c_str(), corbot::inverse_at, name);
    benchmark::RegisterBenchmark(("solutions/" + name).c_str(), corbot::solutions_of, name);
  }
  benchmark::Initialize(&count, arguments);
  benchmark::RunSpecifiedBenchmarks();
}
