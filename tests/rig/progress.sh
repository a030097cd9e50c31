# SPDX-License-Identifier: Apache-2.0
# Progress of what runs, by its lines of output. The host and the guest source this.

# pass_lines SILENCE_S: prints each line of its standard input. It returns 0 at the end, 1 after SILENCE_S
# seconds without a line.
pass_lines() {
  local line status
  while true; do
    status=0
    IFS= read -r -t "$1" line || status=$?
    if [ "$status" -eq 0 ]; then
      printf '%s\n' "$line"
    else
      # The last line may have no end.
      [ -z "$line" ] || printf '%s\n' "$line"
      if [ "$status" -gt 128 ]; then return 1; fi
      return 0
    fi
  done
}

# end_process ID: ends a process, or with -ID a group of them, within some seconds.
end_process() {
  local tries
  kill -TERM -- "$1" 2> /dev/null || return 0
  for ((tries = 0; tries < 50; ++tries)); do
    kill -0 -- "$1" 2> /dev/null || return 0
    sleep 0.1
  done
  kill -KILL -- "$1" 2> /dev/null || true
}
