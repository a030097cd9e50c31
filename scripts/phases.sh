# SPDX-License-Identifier: Apache-2.0
# Functions that `.ci/run` and `scripts/nightly` share: phases with their times, and the check for remains.
# Sourced after common.sh; prints the report when the caller ends.
durations=()

# phase TITLE COMMAND...
phase() {
  local title=$1 begun=$SECONDS
  shift
  say "$title"
  # The command is called plainly, never in a condition, in which bash would ignore `set -e` inside the phase.
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

# Remains of tests accumulate on the machines that run them.
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

# check_sanitizer PRESET TARGET LABEL: runs the tests of a label, a regular expression. cmake/targets.cmake declares
# the labels.
check_sanitizer() {
  build_preset "$1" -DCORBOT_FUZZ=OFF --target "$2"
  ctest --test-dir "build/$1" --output-on-failure --no-tests=error -j "$(test_jobs)" -L "$3"
}

# begin_run NAME: everything newer than this instant counts as remains.
begin_run() {
  run_name=$1
  mkdir -p build
  stamp=build/run-began
  touch "$stamp"
  trap finish EXIT
  trap 'exit 143' TERM INT HUP
}
