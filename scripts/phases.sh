# SPDX-License-Identifier: Apache-2.0
# Functions that `.ci/run` and `scripts/nightly` share: phases with their times, and the check for remains.
# A script sources the file after common.sh. The report comes when the script ends.
durations=()

# phase TITLE COMMAND...: runs the command and records its time.
phase() {
  local title=$1 begun=$SECONDS
  shift
  say "$title"
  # The call is not in a condition, because bash would ignore `set -e` inside the phase then.
  "$@"
  durations+=("$(printf '%5d s  %s' $((SECONDS - begun)) "$title")")
}

finish() {
  local status=$?
  if [ ${#durations[@]} -gt 0 ]; then printf '%s\n' "${durations[@]}"; fi
  if [ "$status" -eq 0 ]; then
    say "$run_name passed in $SECONDS s"
  else
    say "$run_name FAILED in the phase after the last one listed"
  fi
}

# Fails if tests left sockets, processes or files behind. They would accumulate on the machine.
check_left_over() {
  local left='' socket
  for socket in $(find "/tmp/corbot-$(id -u)" -maxdepth 1 -name '*.sock' -newer "$stamp" 2> /dev/null); do
    # The socket of a running robot is not a test's remains; the check for our processes follows below.
    grep -qF "/${socket##*/}" /proc/net/unix || left+="$socket "
  done
  [ -z "$left" ] || fail "left behind: $left"
  left=$(pgrep -a -f "^$PWD/build/(release|asan|tsan)/(bin|tests)/|^qemu-system-x86_64 .*=$PWD/build" || true)
  [ -z "$left" ] || fail "still running: $left"
  left=$(git status --porcelain)
  [ -z "$left" ] || fail "the tree is not clean after build and test:
$left"
}

# check_sanitizer PRESET TARGET LABEL: runs the tests whose label matches the regular expression LABEL.
# cmake/targets.cmake declares the labels.
check_sanitizer() {
  build_preset "$1" -DCORBOT_FUZZ=OFF --target "$2"
  run_tests "build/$1" -L "$3"
}

# begin_run NAME: begins the times and the report. Sockets that are newer count as remains of the tests.
begin_run() {
  run_name=$1
  mkdir -p build
  stamp=build/run-began
  touch "$stamp"
  trap finish EXIT
  trap 'exit 143' TERM INT HUP
}
