// SPDX-License-Identifier: Apache-2.0
// Lines are run by knots and pieces that lie in the servant's segment. Here another process, which has that
// segment mapped, too, overwrites them, their counts and slots and the ring's index at random instants,
// before, while and after the task takes them. Every set-point of the trace is looked at from outside.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <ctime>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include <fmt/core.h>

#include "../unit/channel/ring_access.h"
#include "corbot/channel/fingerprint.h"
#include "corbot/motion/bounds.h"
#include "planner/planner.h"
#include "shm/channel_client.h"
#include "support/cases.h"
#include "support/paths.h"
#include "support/process.h"
#include "support/test_arms.h"

namespace corbot::test {
namespace {

/// Overwrites the servant's segment in bursts, as another process, until it is killed.
class Overwriting {
 public:
  Overwriting(ServantSegment& own, std::atomic<std::uint64_t>& strokes, std::uint64_t seed, bool with_index)
      : own_(own), strokes_(strokes), random_(seed), with_index_(with_index) {}

  [[noreturn]] void run() {
    for (;;) {
      const timespec pause{0, std::uniform_int_distribution<long>(0, 8'000'000)(random_)};
      ::nanosleep(&pause, nullptr);
      const double burst = std::pow(10.0, std::uniform_real_distribution<double>(1.0, 4.5)(random_));
      for (int i = 0; i < static_cast<int>(burst); ++i) {
        one();
        strokes_.fetch_add(1);
      }
      if (with_index_ && dice(4) == 0) index();
    }
  }

 private:
  std::uint64_t dice(std::uint64_t sides) { return random_() % sides; }
  std::uint16_t number() {
    return static_cast<std::uint16_t>(dice(3) == 0 ? random_() : dice(2 * kMostKnots));
  }

  /// Anything that a double can be, and what is nearly right.
  double value(double was) {
    switch (dice(4)) {
      case 0: {
        const std::uint64_t bits = random_();
        return std::bit_cast<double>(bits);
      }
      case 1:
        return std::numeric_limits<double>::quiet_NaN();
      case 2:
        return std::uniform_real_distribution<double>(-7.0, 7.0)(random_);
      default:
        return was + std::pow(10.0, std::uniform_real_distribution<double>(-12.0, 0.0)(random_));
    }
  }
  void one() {
    RateSlot& slot = own_.rates[dice(2) == 0 ? dice(kKnotSlots) : newest()];
    rate::Knot& knot = slot.knots[dice(slot.knots.size())];
    rate::Piece& piece = slot.pieces[dice(slot.pieces.size())];
    const std::size_t part = dice(knot.z.size());
    switch (dice(16)) {
      case 0:
        knot = own_.rates[dice(kKnotSlots)].knots[dice(slot.knots.size())];
        break;
      case 1: {
        KnotRange* const range =
            knots_of(RingIndices::record(own_.commands, own_.commands.published() - dice(3)));
        if (range == nullptr) break;
        *std::array{&range->slot, &range->count, &range->pieces}[dice(3)] = number();
        break;
      }
      case 2:
        if (dice(200) == 0) slot = own_.rates[dice(kKnotSlots)];
        break;
      case 3:
        knot.lambda_s = value(knot.lambda_s);
        break;
      case 4:
      case 5:
        knot.rate[part] = value(knot.rate[part]);
        break;
      case 6:
      case 7:
        knot.bend[part] = value(knot.bend[part]);
        break;
      case 8:
      case 9:
      case 10: {
        double* const numbers[] = {&piece.begin_s, &piece.begin.lambda_s, &piece.begin.v, &piece.begin.a,
                                   &piece.begin.j};
        double& number = *numbers[dice(std::size(numbers))];
        number = value(number);
        break;
      }
      default:
        knot.z[part] = value(knot.z[part]);
    }
  }
  /// Slot of the newest command's knots.
  std::size_t newest() {
    const KnotRange* const range =
        knots_of(RingIndices::record(own_.commands, own_.commands.published() - 1));
    return range == nullptr ? 0 : std::min<std::size_t>(range->slot, kKnotSlots - 1);
  }
  void index() {
    const std::uint64_t head = own_.commands.published();
    RingIndices::set_head(own_.commands, dice(2) == 0 ? random_() : head + dice(5) - 2);
  }

  ServantSegment& own_;
  std::atomic<std::uint64_t>& strokes_;  ///< so far
  std::mt19937_64 random_;
  const bool with_index_;
};

/// Set-points against the limits, tick by tick, by difference quotients.
class TickWatch {
 public:
  explicit TickWatch(const ArmModel& arm) : arm_(arm), period_s_(static_cast<double>(arm.period_ns) * 1e-9) {}

  void expect(const Command& command) { lines_[command.id] = command.line; }
  void see(const Trace& trace) {
    const std::uint64_t end = trace.next();
    if (end - next_ > Trace::capacity()) {  // fell behind: the comparison begins anew
      next_ = end - Trace::capacity() / 2;
      seen_.clear();
    }
    for (; next_ < end; ++next_) {
      Snapshot now{};
      trace.read(next_, now) ? see(now) : seen_.clear();
    }
  }

  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] double acceleration_share() const { return acceleration_share_; }
  [[nodiscard]] double deviation_m() const { return deviation_m_; }
  [[nodiscard]] int moving() const { return moving_; }

 private:
  void fail(const Snapshot& at, const std::string& what, double value, double bound) {
    if (fault_.empty()) fault_ = fmt::format("cycle {}: {} {} beyond {}", at.cycle, what, value, bound);
  }
  void see(const Snapshot& now) {
    // The servos have come to rest meanwhile: what runs begins again there.
    if (!seen_.empty() && now.time_ns - seen_[0].time_ns > 5 * arm_.period_ns) seen_.resize(1);
    seen_.insert(seen_.begin(), now);
    if (seen_.size() > 3) seen_.pop_back();
    if (now.state == RtState::kMoving) ++moving_;
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      const JointLimits& joint = arm_.joints[i];
      const double q = now.position_q[i];
      if (!(q >= joint.lower_q - kRangeTolerance_q && q <= joint.upper_q + kRangeTolerance_q))
        fail(now, fmt::format("joint {} at", i), q, joint.upper_q);
      if (seen_.size() < 2) continue;
      const double speed = std::abs(q - seen_[1].position_q[i]) / period_s_;
      if (!(speed <= joint.speed_q_s * (1.0 + 1e-6) + 1e-6))
        fail(now, fmt::format("joint {} speed", i), speed, joint.speed_q_s);
    }
    see_tool(now);
    const auto line = lines_.find(now.command_id);
    if (line == lines_.end()) return;
    const Vector3 along = line->second.to_m - Vector3(line->second.from_m);
    const Vector3 away = now.tool.position_m - Vector3(line->second.from_m);
    const double off_m = norm(cross(away, along)) / norm(along);
    deviation_m_ = std::max(deviation_m_, off_m);
    if (!(off_m <= kDeviation_m)) fail(now, "off the line by", off_m, kDeviation_m);
  }
  void see_tool(const Snapshot& now) {
    const auto p = [this](std::size_t i) { return arm_.kinematics.forward(seen_[i].position_q).position_m; };
    if (seen_.size() < 2) return;
    const double speed = norm(p(0) - p(1)) / period_s_;
    if (!(speed <= arm_.path.speed_m_s * (1.0 + kForged)))
      fail(now, "tool speed", speed, arm_.path.speed_m_s);
    if (seen_.size() < 3) return;
    const double acceleration = norm((p(0) - p(1)) - (p(1) - p(2))) / (period_s_ * period_s_);
    acceleration_share_ = std::max(acceleration_share_, acceleration / arm_.path.acceleration_m_s2);
    if (!(acceleration <= arm_.path.acceleration_m_s2 * (1.0 + kForged)))
      fail(now, "tool acceleration", acceleration, arm_.path.acceleration_m_s2);
  }

  /// The deviations that the task accepts at a knot, and between two.
  static constexpr double kDeviation_m = 5e-6;
  static constexpr double kForged = 1e-3;

  const ArmModel arm_;
  const double period_s_;
  std::uint64_t next_{0};
  std::vector<Snapshot> seen_;  ///< newest first
  std::map<std::uint64_t, LineMotion> lines_;
  std::string fault_;
  double acceleration_share_{0.0}, deviation_m_{0.0};
  int moving_{0};
};

/// The test plays the servant.
class KnotsOverwritten : public ::testing::Test {
 protected:
  KnotsOverwritten()
      : name_(unique_name("knots")), file_(profile_path("xarm6")), arm_(load_profile(file_).arm) {}
  ~KnotsOverwritten() override {
    if (hostile_ > 0) {
      ::kill(hostile_, SIGKILL);
      ::waitpid(hostile_, nullptr, 0);
    }
    channel_.reset();
    port_.reset();
    if (strokes_ != nullptr) ::munmap(strokes_, sizeof(*strokes_));
    if (task_) {
      EXPECT_EQ(task_->terminate(), 0) << task_->errors();
    }
    EXPECT_FALSE(channel_exists(name_));
  }

  void start(bool with_index) {
    task_ = std::make_unique<Process>(
        std::vector<std::string>{CORBOT_BIN_DIR "/corbot-rt", file_, "--name", name_});
    ASSERT_TRUE(task_->wait_line("ready", within(30))) << task_->errors();
    port_ = std::make_unique<ServantPort>(name_, fingerprint(arm_), nullptr);
    channel_ = port_->connect([] { return false; });
    ASSERT_TRUE(wait_until(within(30), [&] { return channel_->is_served(); }));
    void* const shared =
        ::mmap(nullptr, sizeof(*strokes_), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(shared, MAP_FAILED);
    strokes_ = new (shared) std::atomic<std::uint64_t>{0};
    const std::uint64_t seed_of_it = random_();
    hostile_ = ::fork();
    ASSERT_GE(hostile_, 0);
    if (hostile_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      Overwriting(channel_->own(), *strokes_, seed_of_it, with_index).run();
    }
  }
  /// The servant's beat, and a look at the set-points since.
  Snapshot look() {
    channel_->own().control.servant_beat.fetch_add(1);
    watch_.see(channel_->task().trace);
    Snapshot now{};
    (void)last_snapshot(channel_->task(), now);
    return now;
  }
  /// The first one names what put the task into Error; alarms of refusals stay.
  std::optional<AlarmEvent> alarm() {
    AlarmEvent taken{};
    if (RingConsumer(channel_->task().alarms, channel_->own().alarms_tail).pop(taken) != PopResult::kOk)
      return std::nullopt;
    return taken;
  }
  /// One line to and fro; its verdict. An Error must have a cause, and a Clear must end it.
  std::optional<Verdict> travel(bool there) {
    const Snapshot rest = look();
    const Vector3 to_m =
        arm_.kinematics.forward({}).position_m + (there ? Vector3{0.01, 0.06, -0.03} : Vector3{});
    const PlanResult plan = planner_.move_s({rest.position_q, rest.gripper}, {}, to_m, 0.0);
    if (!std::holds_alternative<std::vector<Command>>(plan)) return std::nullopt;  // it stands there
    Command command = std::get<std::vector<Command>>(plan).front();
    ServantSegment& own = channel_->own();
    command.id = own.next_command_id.fetch_add(1);
    command.epoch = channel_->stops();
    command.incarnation = static_cast<std::uint32_t>(channel_->task().incarnation);
    KnotRange* const range = knots_of(command);
    range->slot = static_cast<std::uint16_t>(command.id % kKnotSlots);
    watch_.expect(command);
    // In half of the rounds what is handed over lies there for some strokes before the task may take it.
    const bool waits = random_() % 2 == 0;
    own.control.pause.store(waits ? 1 : 0);
    if (waits) {
      EXPECT_TRUE(wait_until(within(30), [&] { return (look().flags & kSnapshotPaused) != 0; }));
    }
    const PlannedRate& rate = plan.rates.front();
    std::copy(rate.knots.begin(), rate.knots.end(), own.rates[range->slot].knots.begin());
    std::copy(rate.pieces.begin(), rate.pieces.end(), own.rates[range->slot].pieces.begin());
    const bool is_pushed = RingProducer(own.commands, channel_->task().commands_tail).push(command);
    if (waits) {
      const double most = std::pow(10.0, std::uniform_real_distribution<double>(0.0, 3.5)(random_));
      const std::uint64_t enough = strokes_->load() + static_cast<std::uint64_t>(most);
      EXPECT_TRUE(wait_until(within(30), [&] {
        (void)look();
        return strokes_->load() >= enough;
      }));
      own.control.pause.store(0);
    }
    std::optional<Verdict> verdict;
    EXPECT_TRUE(wait_until(
        within(30),
        [&] {
          const Snapshot now = look();
          Completion done{};
          while (RingConsumer(channel_->task().completions, own.completions_tail).pop(done) == PopResult::kOk)
            if (done.id == command.id) verdict = done.verdict;
          return now.command_id == 0 &&
                 (verdict || (!is_pushed && now.last_done_id >= command.id) || now.state == RtState::kError);
        }))
        << "command " << command.id;
    std::vector<AlarmEvent> alarms;
    while (const auto one = alarm()) alarms.push_back(*one);
    if (look().state == RtState::kError) {
      EXPECT_FALSE(alarms.empty()) << "an Error without a cause";
      own.control.clear_count.fetch_add(1);
      EXPECT_TRUE(wait_until(within(30), [&] { return look().state == RtState::kStandby; }));
    } else if (verdict && (*verdict == Verdict::kMalformed || *verdict == Verdict::kLimit)) {
      EXPECT_FALSE(alarms.empty()) << "a refusal without a cause";
    }
    for (const AlarmEvent& one : alarms) ++causes_[one.code];
    return verdict;
  }

  std::mt19937_64 random_{test::drawn_seed()};
  const std::string name_;
  const std::string file_;
  const ArmModel arm_;
  const Planner planner_{arm_};
  TickWatch watch_{arm_};
  std::map<AlarmCode, int> causes_;
  std::unique_ptr<Process> task_;
  std::unique_ptr<ServantPort> port_;
  std::shared_ptr<ServantChannel> channel_;
  pid_t hostile_{0};
  std::atomic<std::uint64_t>* strokes_{nullptr};  ///< of the other process, which shares it
};

constexpr int kWanted = 8;
constexpr int kMostRounds = 300;

TEST_F(KnotsOverwritten, ALineIsCarriedOutAsPlannedOrRefusedWithItsCause) {
  ASSERT_NO_FATAL_FAILURE(start(false));
  std::map<Verdict, int> ended;
  bool there = true;
  for (int i = 0; i < kMostRounds && !HasFailure() &&
                  (ended[Verdict::kDone] < kWanted || ended[Verdict::kMalformed] < kWanted);
       ++i) {
    const auto verdict = travel(there);
    if (!verdict || *verdict == Verdict::kDone) there = !there;
    if (verdict) ++ended[*verdict];
    ASSERT_EQ(watch_.fault(), "");
  }
  fmt::print("{} done, {} refused; tool acceleration at most {:.6f} of its limit, off the line {:.1e} m\n",
             ended[Verdict::kDone], ended[Verdict::kMalformed] + ended[Verdict::kLimit],
             watch_.acceleration_share(), watch_.deviation_m());
  EXPECT_GE(ended[Verdict::kDone], kWanted) << "the task goes on";
  EXPECT_GE(ended[Verdict::kMalformed], kWanted);
  EXPECT_EQ(ended[Verdict::kFault], 0);
  EXPECT_GT(watch_.moving(), 250);
  EXPECT_TRUE(task_->running());
}

TEST_F(KnotsOverwritten, WithTheRingsIndexTheTaskGoesOnOrNamesTheCause) {
  ASSERT_NO_FATAL_FAILURE(start(true));
  bool there = true;
  int done = 0;
  for (int i = 0;
       i < kMostRounds && !HasFailure() && (done < kWanted || causes_[AlarmCode::kRingCorrupt] < kWanted);
       ++i) {
    const auto verdict = travel(there);
    if (!verdict || *verdict == Verdict::kDone) there = !there;
    done += verdict == Verdict::kDone ? 1 : 0;
    ASSERT_EQ(watch_.fault(), "");
  }
  fmt::print("{} done, {} alarms of the ring; tool acceleration at most {:.6f} of its limit\n", done,
             causes_[AlarmCode::kRingCorrupt], watch_.acceleration_share());
  EXPECT_GE(done, kWanted) << "the task goes on";
  EXPECT_GE(causes_[AlarmCode::kRingCorrupt], kWanted);
  EXPECT_TRUE(task_->running());
}

}  // namespace
}  // namespace corbot::test
