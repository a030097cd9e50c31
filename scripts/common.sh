# SPDX-License-Identifier: Apache-2.0
# Functions that the scripts share. A script sources this file, and is then in the project's top directory.
set -euo pipefail

# A script is asked for help: its first comment is the answer. `$1` is the script's own here.
if [[ "${1:-}" == -h || "${1:-}" == --help ]]; then
  sed -n '3,${/^#/!q;s/^# \{0,1\}//p}' "$0"
  exit 0
fi
cd "$(dirname "${BASH_SOURCE[0]}")/.."

say() { printf '== %s\n' "$*"; }
fail() { printf '%s: %s\n' "$(basename "$0")" "$*" >&2; exit 1; }

# For a script without arguments: refuses each.
takes_no_arguments() { [ $# -eq 0 ] || fail "takes no arguments, so '$1' is refused"; }

autogroup_file=/proc/sys/kernel/sched_autogroup_enabled

# Prints the number of ctest's processors, of which a test takes one or more. Each is a sixth of one of the
# machine's: most tests wait, and the others declare their load. Without the kernel's automatic groups of
# tasks, which phases.sh explains, each is an eighth.
test_jobs() {
  local each=8
  if [ "$(cat "$autogroup_file" 2> /dev/null)" = 1 ]; then each=6; fi
  echo $(($(nproc) * each))
}

# run_tests DIR ARGUMENT...: runs the tests of the build directory DIR with these arguments for ctest. At the
# end it prints the last lines of each failed test again, because a report may keep only the end of the log.
run_tests() {
  local dir=$1 status=0
  shift
  ctest --test-dir "$dir" --output-on-failure --no-tests=error -j "$(test_jobs)" "$@" || status=$?
  if [ "$status" -ne 0 ]; then
    awk '/^[0-9]+\/[0-9]+ Testing: / { name = $3; count = 0 }
         { lines[count++] = $0 }
         /^Test Fail(ed\.| Reason:)$/ {
           print "== the end of " name
           for (i = count > 30 ? count - 30 : 0; i < count; ++i) print substr(lines[i], 1, 300)
         }' "$dir/Testing/Temporary/LastTest.log"
  fi
  return "$status"
}

# build_preset PRESET [-D… for the configuration] [--target names]: configures and builds build/PRESET, with
# ccache if it is installed. An object of another clone with the same sources is a hit, too.
build_preset() {
  local preset=$1 configuration=() build=() option
  for option in "${@:2}"; do
    case $option in -D*) configuration+=("$option") ;; *) build+=("$option") ;; esac
  done
  if command -v ccache > /dev/null; then
    export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
    configuration+=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  fi
  cmake --preset "$preset" "${configuration[@]}" > /dev/null ||
    fail "cmake --preset $preset does not configure"
  cmake --build --preset "$preset" "${build[@]}" || fail "build/$preset does not build"
}
