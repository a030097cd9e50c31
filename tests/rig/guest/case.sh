# SPDX-License-Identifier: Apache-2.0
# Functions that all cases share; sourced. The caller is in the project's top directory, and the environment
# names the devices.
set -euo pipefail
guest=tests/rig/guest
export XDG_RUNTIME_DIR=/run/corbot
mkdir -p -m 700 "$XDG_RUNTIME_DIR"
work=$(mktemp -d)
supervisor='' emulator='' cable=''

say() { printf '   %s\n' "$*"; }
fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }
skip() { printf 'skipped: %s\n' "$*"; exit 77; }

# until_true LIMIT_S COMMAND...: waits for it to succeed.
until_true() {
  local end=$((SECONDS + $1))
  shift
  while ! "$@"; do
    if [ "$SECONDS" -ge "$end" ]; then return 1; fi
    sleep 0.1
  done
}

# write_profile: sets profile to a copy of lynx5 with the backend that standard input describes. On this
# emulated machine tracing and emulated devices make gaps that are no fault, and a device under strace takes a
# third of the frames that it announced.
write_profile() {
  profile=$work/arm.toml
  { sed -e '/^\[backend\]/,$d' -e 's/^gap_fault_ms = 100 /gap_fault_ms = 10000 /' \
        -e 's/^settle_s = 1.0 /settle_s = 20.0 /' profiles/lynx5.toml
    cat; } > "$profile"
}

# robot_up PROFILE [option of corbot up...]: real-time or not at all. Sets rt_pid and rt_thread.
robot_up() {
  corbot up "$@" --realtime enforce > "$work/up.log" 2>&1 &
  supervisor=$!
  until_true 60 robot_is_up || { cat "$work/up.log" >&2; fail "the robot did not come up"; }
  rt_pid=$(pgrep -P "$supervisor" corbot-rt)
  # Takes the thread under SCHED_FIFO, the first one if a backend has more: proc(5), stat, fields 41 and 40.
  rt_thread=$(awk '$41 == 1 { print $40, $1 }' "/proc/$rt_pid"/task/*/stat |
    sort -n | tail -n 1 | cut -d' ' -f2)
  [ -n "$rt_thread" ] || fail "no thread of corbot-rt is under SCHED_FIFO"
}
robot_is_up() {
  kill -0 "$supervisor" 2> /dev/null || { cat "$work/up.log" >&2; fail "corbot up ended"; }
  grep -q ' is up at ' "$work/up.log"
}
# Returns what corbot up does.
robot_down() {
  local pid=$supervisor
  supervisor=''
  [ -n "$pid" ] || return 0
  kill -TERM "$pid" 2> /dev/null || true
  wait "$pid" || { printf 'FAILED: the robot did not end cleanly\n' >&2; return 1; }
}
robot_state() { corbot status --json | sed -n 's/.*"state": "\(.*\)".*/\1/p'; }
robot_is() { [ "$(robot_state)" = "$1" ]; }

# emulator_on FAR_END WORDS...: corbot-sim WORDS... at the far end of a serial line.
emulator_on() {
  local far=$1
  shift
  mkfifo "$work/orders"
  exec {orders}<> "$work/orders"
  corbot-sim "$@" --pty "$work/far" < "$work/orders" > "$work/answers" &
  emulator=$!
  until_true 30 grep -q '^ready' "$work/answers" || fail "no emulator"
  socat "FILE:$far" "FILE:$work/far,raw,echo=0" &
  cable=$!
}
# emulator_pulses: the line 'pulses CH=US...'.
emulator_pulses() {
  local before
  before=$(grep -c '^pulses' "$work/answers" || true)
  echo pulses >&"$orders"
  until_true 10 emulator_answered "$before" || fail "the emulator does not answer"
  grep '^pulses' "$work/answers" | tail -n 1
}
emulator_answered() { [ "$(grep -c '^pulses' "$work/answers")" -gt "$1" ]; }

clean_up() {
  local status=$? pid
  trap - EXIT
  if ! robot_down && [ "$status" -eq 0 ]; then status=1; fi
  if [ "$status" -ne 0 ] && [ -f "$work/up.log" ]; then cat "$work/up.log" >&2; fi
  for pid in $cable $emulator; do kill "$pid" 2> /dev/null || true; wait "$pid" 2> /dev/null || true; done
  rm -rf "$work"
  exit "$status"
}
trap clean_up EXIT
