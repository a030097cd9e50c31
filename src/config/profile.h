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
  double frame_hz{50.0};         ///< rate at which pulses reach the servos
  double rate_us_per_s{2400.0};  ///< slew of a servo, in pulse width
  double dead_band_us{0.0};      ///< a servo ignores smaller differences
  double lag_s{0.0};             ///< time constant of a servo, 0 = none
};

/// `[backend.ssc32]`, `[backend.maestro]`, `[backend.minissc]`: a servo controller on a serial line.
struct SerialOptions {
  std::string port;  ///< /dev/..., or unix:/path of a stream socket
  int baud{115200};
  int device_number{-1};  ///< Maestro: number in the Pololu protocol; -1: compact protocol
  bool crc{false};        ///< Maestro
  /// Maestro: sets several targets in one command; only a Mini Maestro supports that
  bool multi_target{false};
  bool detect_baud{false};  ///< Maestro: is set to detect the baud
  double first_us{500.0};   ///< Mini SSC: pulse of position 0
  double last_us{2500.0};   ///< Mini SSC: pulse of position 254
  char stop_input{0};       ///< SSC-32: input of an emergency stop, 'A' .. 'F'; 0: none
  bool stop_at_high{true};  ///< SSC-32: pressed is 5 V
};

/// `[backend.pca9685]`: a PWM chip on I2C.
struct Pca9685Options {
  std::string bus;             ///< /dev/i2c-N
  int address{0x40};           ///< of the chip, seven bits
  double frame_hz{50.0};       ///< requested; the chip has 253 rates
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
  bool staggered{true};  ///< every pulse in its own slot; else all begin together
  int priority{0};       ///< SCHED_FIFO priority of the pulses' thread; 0: one above the loop's
  int cpu{-1};           ///< of that thread; -1: any
  /// Time before the end of a pulse in which the thread is awake and polls the clock; 0: it sleeps until the
  /// end.
  double awake_us{50.0};
};

/// `[emergency_stop]`: an input that stops the arm, with any backend.
struct EmergencyStopOptions {
  std::string chip;  ///< /dev/gpiochipN; empty: no input
  std::string line;  ///< name, or offset in digits
  bool active_low{false};
  std::string bias{"pull-up"};  ///< "pull-up", "pull-down", "none" or "as-is"
};

/// `[power_enable]`: an output that switches the power of the servos.
struct PowerEnableOptions {
  std::string chip;  ///< /dev/gpiochipN; empty: no output
  std::string line;
  bool active_low{false};
  bool off_at_stop{true};  ///< power stays off from an emergency stop until it is cleared
};

/// `[watchdog]`: an output that toggles while corbot works, for a charge pump that holds the servos' power.
struct WatchdogOptions {
  std::string chip;  ///< /dev/gpiochipN; empty: no output
  std::string line;
  bool active_low{false};
  std::int64_t period_ns{10'000'000};  ///< between two changes of its level
};

/// 1018h:1 to 4 of a drive: vendor, product, revision, serial; only those with a value are checked.
using CanIdentity = std::array<std::optional<std::uint32_t>, 4>;

/// `homing_...` of a drive without an absolute encoder.
struct CanHoming {
  int method{};  ///< 6098h; 0: none, the drive keeps its count
  double speed_q_s{};
  double creep_q_s{};
  double acceleration_q_s2{};  ///< 0: the drive's own value
  double offset{};             ///< 607Ch, counts
};

/// `[[backend.socketcan.drive]]`: count = zero_count + direction * counts_per_q * q.
struct CanDrive {
  int node{};  ///< 1 to 127
  double counts_per_q{};
  double zero_count{};
  double direction{1.0};
  CanIdentity identity{};
  bool reports_following{true};  ///< in bit 12 of the statusword
  CanHoming homing{};
};

/// `[backend.socketcan]`: CiA 402 drives on a CAN bus.
struct SocketCanOptions {
  std::string interface;  ///< "can0", or "unix:/path" for a virtual bus
  int bit_rate{0};        ///< bits a second; 0: the interface's own
  int heartbeat_ms{200};
  int watch_ms{0};               ///< drives react when corbot has been silent for this time; 0: off
  std::vector<CanDrive> drives;  ///< one for each joint, in order
  int gripper_node{0};           ///< 0: no drive
  double gripper_closed_count{};
  double gripper_open_count{};
  CanIdentity gripper_identity{};
  bool gripper_reports_following{true};
};

/// Options that several kinds have, each in its own table.
struct CommonBackendOptions {
  bool readback{false};      ///< read the servos' positions, as the device reports them
  bool relax_at_end{false};  ///< pulses or voltage off at the end; else the servos hold
  int stagger_ms{100};       ///< between the first pulses of two servos, or the enabling of two drives
};

/// `[backend]`: the backend that drives the servos, and the options of that kind.
struct BackendOptions {
  std::string kind{"loopback"};
  /// At power-up the arm is where corbot left it, or at angle 0. False: the position is unverified, and the
  /// first motion is slow. Default: true for the simulator only.
  bool position_known_at_start{true};
  CommonBackendOptions common{};  ///< of the selected kind
  LoopbackOptions loopback{};
  SerialOptions serial{};  ///< of the selected kind
  Pca9685Options pca9685{};
  PwmSysfsOptions pwm_sysfs{};
  GpiodOptions gpiod{};
  SocketCanOptions socketcan{};
};

/// `[stop]`: how faults and stop inputs end a motion. The categories are those of IEC 60204-1.
struct StopOptions {
  int category{1};     ///< 0: the servos' power is cut at once; 1: it is cut when the arm has decelerated
  double ramp_s{1.0};  ///< the power is cut after this time, even if the arm still moves
};

/// `following_error_...` and `goal_tolerance_deg` of a `[[joint]]`: used if the device measures.
struct FollowingLimits {
  double error_q{};  ///< between set-point and measured joint; a fault if it lasts for time_s
  double time_s{};
  double goal_q{};  ///< a motion is done when the joint is this near to its end
};

/// `[supervisor]`: the reaction of `corbot up` to a process that does not respond.
struct SupervisorOptions {
  double respond_s{3.0};  ///< a process that does not respond for this time is killed and restarted
  int attempts{10};       ///< consecutive failed starts before it gives up; 0: endless
};

/// One robot as in its profile: validated, in SI units and radians, immutable.
struct Profile {
  std::string name;  ///< ASCII letters, digits, '_' and '-'; at most kMaxNameLength
  std::string file;  ///< as given by the caller
  ArmModel arm;
  config::ArmDescription description;    ///< the arm as in the file, for people
  std::vector<std::string> joint_names;  ///< one for each joint, in order
  /// One for each joint. False: the file has no servo, and the servo map is the simulator's.
  std::vector<bool> has_servo;
  bool gripper_has_servo{true};            ///< false: the file has none
  int priority{80};                        ///< SCHED_FIFO, 1 … 98
  int cpu{-1};                             ///< processor of the real-time task; −1: any
  std::int64_t gap_fault_ns{100'000'000};  ///< a longer gap between two cycles is a fault
  std::int64_t frozen_ns{100'000'000};     ///< a task whose cycle number stalls this long does not respond
  std::int64_t orphan_ns{2'000'000'000};   ///< a motion without a servant that responds is stopped after this
  BackendOptions backend;
  std::vector<FollowingLimits> following;  ///< one for each joint, in order
  double settle_s{1.0};                    ///< a motion that has not reached its end by then is a fault
  StopOptions stop;
  EmergencyStopOptions emergency_stop;
  PowerEnableOptions power_enable;
  WatchdogOptions watchdog;
  SupervisorOptions supervisor;
  int queue_capacity{16};                  ///< motions pending at once
  std::string endpoint_host{"127.0.0.1"};  ///< address at which the servant listens
  int port{12810};                         ///< port at which the servant listens
};

/// Returns true if the servos are, or may be, without pulses or power after the real-time task has ended.
/// Their position is then unverified.
[[nodiscard]] bool unpowered_after_exit(const Profile& profile);
/// Returns true if corbot switches the servos' power, which is off while no corbot process runs.
[[nodiscard]] bool switches_power(const Profile& profile);

inline constexpr std::size_t kMaxNameLength = 32;
/// Returns true if a robot or a joint may have this name.
[[nodiscard]] bool is_name(std::string_view text);
/// Describes the allowed names: "1 to 32 ASCII letters, digits, '_' or '-'".
[[nodiscard]] std::string name_rule();

/// One fault of a profile. `text()` is "file:line: key = value: what is allowed".
struct ConfigFault {
  std::string file;
  std::uint32_t line{};  ///< from 1; 0 for the whole file
  std::string key;       ///< with its table: "joint[2].range_deg"; empty for the whole file
  std::string value;     ///< as read; empty if there is none
  std::string allowed;   ///< the fault and the allowed values
  std::string name;      ///< of the table with the key, such as "pallet1"; empty if the key is enough
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
