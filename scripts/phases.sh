# SPDX-License-Identifier: Apache-2.0
# Functions of `.ci/run` and `scripts/nightly`: phases with their times, and the check for remains.
# A script sources the file after common.sh. The report comes when the script ends.
durations=()

# phase TITLE COMMAND...: runs the command and records its time.
phase() {
  local title=$1 begun=$SECONDS
  shift
  running=$title
  say "$title"
  # The call is not in a condition, because bash would ignore `set -e` inside the phase then.
  "$@"
  durations+=("$(printf '%5d s  %s' $((SECONDS - begun)) "$title")")
}

finish() {
  local status=$?
  if [ -n "$beside" ]; then kill -- "-$beside" 2> /dev/null || true; fi
  if [ -n "$autogroup" ]; then echo "$autogroup" > "$autogroup_file" || true; fi
  if [ ${#durations[@]} -gt 0 ]; then printf '%s\n' "${durations[@]}"; fi
  if [ "$status" -eq 0 ]; then
    say "$run_name passed in $SECONDS s"
  else
    say "$run_name FAILED in the phase '$running'"
  fi
}

# Fails if tests left sockets, processes or files behind. They would accumulate on the machine.
check_left_over() {
  local left='' socket directories=("/tmp/corbot-$(id -u)" "${XDG_RUNTIME_DIR:-/none}/corbot")
  for socket in $(find "${directories[@]}" -maxdepth 1 -name '*.sock' -newer "$stamp" 2> /dev/null); do
    # The socket of a running robot is not a test's remains; the check for our processes follows below.
    grep -qF "/${socket##*/}" /proc/net/unix || left+="$socket "
  done
  # Fixtures' directories, here and beside the programs; that of the sockets stays.
  left+=$(find build/{release,asan,tsan}/tests -mindepth 1 -maxdepth 1 -type d -name '*-*' -newer "$stamp" \
            2> /dev/null || true)
  left+=$(find "${TMPDIR:-/tmp}" -maxdepth 1 -user "$(id -u)" -name 'corbot-*' -newer "$stamp" \
            ! -name "corbot-$(id -u)" 2> /dev/null || true)
  [ -z "$left" ] || fail "left behind: $left"
  left=$(pgrep -a -f "^$PWD/build/(release|asan|tsan)/(bin|tests)/|^qemu-system-x86_64 .*=$PWD/build" || true)
  [ -z "$left" ] || fail "still running: $left"
  left=$(git status --porcelain)
  [ "$left" = "$changed" ] || fail "build and tests changed the tree:
$left"
}

# beside TITLE COMMAND...: runs the command at idle priority beside the next phases, until the phase `join`.
# With automatic groups it would delay them, and is a phase before them, with this title.
beside() {
  if [ "$(cat "$autogroup_file" 2> /dev/null)" = 1 ]; then
    phase "$@"
    return
  fi
  shift
  set -m  # gives the command a process group, by which the end of the run ends all of it
  (chrt --idle --pid 0 "$BASHPID" && "$@") > build/beside.log 2>&1 &
  beside=$!
  set +m
}

# Waits for the command of `beside`, prints its output, and fails if it failed.
join() {
  local status=0
  [ -n "$beside" ] || return 0
  wait "$beside" || status=$?
  beside=''
  cat build/beside.log
  return "$status"
}

# Turns off the kernel's automatic groups of tasks, if the run may, until its end. With groups, the worker of
# Linux 6.18 that carries the bytes of pseudo-terminals waits up to a minute beside programs that compute. A
# run that SIGKILL ends leaves them off.
without_autogroup() {
  autogroup=$(cat "$autogroup_file" 2> /dev/null) || true
  if [ "$autogroup" = 1 ] && echo 0 2> /dev/null > "$autogroup_file"; then return; fi
  [ "$autogroup" != 1 ] || say "kernel.sched_autogroup_enabled stays 1: only root can change it"
  autogroup=''
}

# begin_run NAME: begins the times and the report. Sockets that are newer count as remains of the tests, and
# so do files of the tree that differ then and not yet now.
begin_run() {
  run_name=$1
  running=''
  changed=$(git status --porcelain)
  beside=''
  mkdir -p build
  autogroup=''
  stamp=build/run-began
  touch "$stamp"
  trap finish EXIT
  trap 'exit 143' TERM INT HUP
  without_autogroup
}
