// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "config/arms/description.h"
#include "corbot/arm/arm_model.h"

namespace corbot {

/// `[backend.loopback]`: the simulated servos behind the loopback backend.
struct LoopbackOptions {
  double frame_hz{50.0};         ///< pulses reach the servos this often
  double rate_us_per_s{2400.0};  ///< slew of a servo, in pulse width
  double dead_band_us{0.0};      ///< a servo ignores smaller differences
  double lag_s{0.0};             ///< time constant of a servo, 0 = none
};

/// `[backend.ssc32]`, `[backend.maestro]`, `[backend.minissc]`: a servo controller on a serial line.
struct SerialOptions {
  std::string port;  ///< /dev/..., or unix:/path of a stream socket
  int baud{115200};
  int device_number{-1};     ///< Maestro: of the Pololu protocol; -1: compact protocol
  bool crc{false};           ///< Maestro
  bool multi_target{false};  ///< Maestro: sets several targets in one command, as only a Mini Maestro can
  bool detect_baud{false};   ///< Maestro: it is set to detect the baud
  double first_us{500.0};    ///< Mini SSC: pulse of position 0
  double last_us{2500.0};    ///< Mini SSC: pulse of position 254
  char stop_input{0};        ///< SSC-32: input of an emergency stop, 'A' .. 'F'; 0: none
  bool stop_at_high{true};   ///< SSC-32: pressed is 5 V
};

/// `[backend.pca9685]`: a PWM chip on I2C.
struct Pca9685Options {
  std::string bus;             ///< /dev/i2c-N
  int address{0x40};           ///< of the chip, seven bits
  double frame_hz{50.0};       ///< wanted; the chip has 253 rates
  double oscillator_hz{25e6};  ///< of this chip, as measured
};

/// `[backend.pwm_sysfs]`: PWM outputs of the kernel.
struct PwmSysfsOptions {
  std::string chip;  ///< directory, /sys/class/pwm/pwmchipN
  double frame_hz{50.0};
};

/// `[backend.gpiod]`: servo pulses on GPIO lines.
struct GpiodOptions {
  std::string chip;                ///< /dev/gpiochipN
  std::vector<std::string> lines;  ///< by channel: names, or offsets in digits
  double frame_hz{50.0};
  bool staggered{true};  ///< every pulse in a slot of its own; else all begin together
  int priority{0};       ///< SCHED_FIFO of the pulses' thread; 0: one above the loop's
  int cpu{-1};           ///< that it is bound to; -1: any
  /// The thread is awake this long before a pulse ends and polls the clock; 0: it sleeps until then.
  double awake_us{50.0};
};

/// `[emergency_stop]`: an input that stops the arm, whatever the backend.
struct EmergencyStopOptions {
  std::string chip;  ///< /dev/gpiochipN; empty: there is none
  std::string line;  ///< name, or offset in digits
  bool active_low{false};
  std::string bias{"pull-up"};  ///< "pull-up", "pull-down", "none" or "as-is"
};

/// `[power_enable]`: an output that switches the power of the servos.
struct PowerEnableOptions {
  std::string chip;  ///< /dev/gpiochipN; empty: there is none
  std::string line;
  bool active_low{false};
  bool off_at_stop{true};  ///< without power from an emergency stop until it is cleared
};

/// `[watchdog]`: an output that toggles while corbot is well, for a charge pump that holds the servos' power.
struct WatchdogOptions {
  std::string chip;  ///< /dev/gpiochipN; empty: there is none
  std::string line;
  bool active_low{false};
  std::int64_t period_ns{10'000'000};  ///< between two changes of its level
};

/// 1018h:1 to 4 of a drive: vendor, product, revision, serial; those that are checked.
using CanIdentity = std::array<std::optional<std::uint32_t>, 4>;

/// `homing_...` of a drive without an absolute encoder.
struct CanHoming {
  int method{};  ///< 6098h; 0: none, the drive keeps its count
  double speed_q_s{};
  double creep_q_s{};
  double acceleration_q_s2{};  ///< 0: as the drive has it
  double offset{};             ///< 607Ch, counts
};

/// `[[backend.socketcan.drive]]`: count = zero_count + direction * counts_per_q * q.
struct CanDrive {
  int node{};  ///< 1 to 127
  double counts_per_q{};
  double zero_count{};
  double direction{1.0};
  CanIdentity identity{};
  bool reports_following{true};  ///< by bit 12 of the statusword
  CanHoming homing{};
};

/// `[backend.socketcan]`: drives after CiA 402 on a CAN bus.
struct SocketCanOptions {
  std::string interface;  ///< "can0", or "unix:/path" for a virtual bus
  int bit_rate{0};        ///< bits a second; 0: as the interface is set
  int heartbeat_ms{200};
  int watch_ms{0};               ///< drives react when corbot is silent for so long; 0: off
  std::vector<CanDrive> drives;  ///< one a joint, in their order
  int gripper_node{0};           ///< 0: no drive
  double gripper_closed_count{};
  double gripper_open_count{};
  CanIdentity gripper_identity{};
  bool gripper_reports_following{true};
};

/// What several kinds have, each in its own table.
struct CommonBackendOptions {
  bool readback{false};      ///< ask for the servos' positions, as the device has them
  bool relax_at_end{false};  ///< pulses or voltage off at the end; else the servos hold
  int stagger_ms{100};       ///< between the first pulses of two servos, or the enabling of two drives
};

/// `[backend]`: which backend drives the servos, and the options of that kind.
struct BackendOptions {
  std::string kind{"loopback"};
  /// At power-up the arm is where corbot left it, or at angle 0. False: position unverified, the first motion
  /// is slow. Default: true for the simulator only.
  bool position_known_at_start{true};
  CommonBackendOptions common{};  ///< of the kind that was chosen
  LoopbackOptions loopback{};
  SerialOptions serial{};  ///< of the kind that was chosen
  Pca9685Options pca9685{};
  PwmSysfsOptions pwm_sysfs{};
  GpiodOptions gpiod{};
  SocketCanOptions socketcan{};
};

/// `[stop]`: how faults and stop inputs end a motion. The categories are those of IEC 60204-1.
struct StopOptions {
  int category{1};     ///< 0: the servos' power is taken off at once; 1: when the arm has slowed down
  double ramp_s{1.0};  ///< the power is taken off after this, whether or not the arm has come to rest
};

/// `following_error_...` and `goal_tolerance_deg` of a `[[joint]]`: where the device measures.
struct FollowingLimits {
  double error_q{};  ///< between set-point and measured joint; a fault when it lasts for time_s
  double time_s{};
  double goal_q{};  ///< a motion is done when the joint is this near to its end
};

/// `[supervisor]`: what `corbot up` does with a process that does not respond.
struct SupervisorOptions {
  double respond_s{3.0};  ///< it is killed and started again when it does not respond for so long
  int attempts{10};       ///< starts in a row that do not get ready before it is given up; 0: endless
};

/// One robot as its profile describes it: validated, in SI units and radians, immutable.
struct Profile {
  std::string name;  ///< ASCII letters, digits, '_' and '-'; at most kMaxNameLength
  std::string file;  ///< as the caller gave it
  ArmModel arm;
  config::ArmDescription description;    ///< as the file describes the arm, for people
  std::vector<std::string> joint_names;  ///< one a joint, in their order
  std::vector<bool>
      has_servo;  ///< one a joint; false: the file has none, and its servo map is the simulator's
  bool gripper_has_servo{true};            ///< likewise
  int priority{80};                        ///< SCHED_FIFO, 1 … 98
  int cpu{-1};                             ///< that the real-time task is bound to; −1: any
  std::int64_t gap_fault_ns{100'000'000};  ///< a longer gap between two cycles is a fault
  std::int64_t frozen_ns{100'000'000};  ///< a task whose cycle number stands still this long does not respond
  std::int64_t orphan_ns{2'000'000'000};  ///< a motion without a servant that responds is stopped after this
  BackendOptions backend;
  std::vector<FollowingLimits> following;  ///< one a joint, in their order
  double settle_s{1.0};                    ///< a motion whose end is not reached by then is a fault
  StopOptions stop;
  EmergencyStopOptions emergency_stop;
  PowerEnableOptions power_enable;
  WatchdogOptions watchdog;
  SupervisorOptions supervisor;
  int queue_capacity{16};                  ///< motions outstanding at once
  std::string endpoint_host{"127.0.0.1"};  ///< the servant listens here
  int port{12810};                         ///< and here
};

/// Whether the servos are, or may be, without pulses or power after the real-time task has ended: their
/// position is then unverified.
[[nodiscard]] bool unpowered_after_exit(const Profile& profile);
/// Whether corbot switches the servos' power, which is off then without a process of its own.
[[nodiscard]] bool switches_power(const Profile& profile);

inline constexpr std::size_t kMaxNameLength = 32;
/// Whether a robot or a joint may have this name.
[[nodiscard]] bool is_name(std::string_view text);
/// What it allows: "1 to 32 ASCII letters, digits, '_' or '-'".
[[nodiscard]] std::string name_rule();

/// One thing that is wrong with a profile. `text()` is "file:line: key = value: what is allowed".
struct ConfigFault {
  std::string file;
  std::uint32_t line{};  ///< from 1; 0 where the whole file is meant
  std::string key;       ///< with its table: "joint[2].range_deg"; empty where the whole file is meant
  std::string value;     ///< as read; empty where there is none
  std::string allowed;   ///< what is wrong and what is allowed
  [[nodiscard]] std::string text() const;
};

/// All faults of one profile; what() lists them, one a line.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(std::vector<ConfigFault> faults);
  [[nodiscard]] const std::vector<ConfigFault>& faults() const noexcept { return faults_; }

 private:
  std::vector<ConfigFault> faults_;
};

}  // namespace corbot
