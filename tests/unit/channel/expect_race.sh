#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# expect_race.sh PROGRAM VARIANT: 'right' must run clean; every other variant must be reported as a data race.
output=$(TSAN_OPTIONS="exitcode=66 halt_on_error=1" "$1" "$2" 2>&1)
code=$?
if [ "$code" -eq 77 ]; then
  echo "$output"
  exit 77
fi
if [ "$2" = right ]; then
  if [ "$code" -ne 0 ]; then
    echo "$output"
    echo "the right orders were reported, or the program failed (exit code $code)"
    exit 1
  fi
  exit 0
fi
case "$code:$output" in
  66:*"ThreadSanitizer: data race"*) exit 0 ;;
esac
echo "$output"
echo "variant $2 passed unnoticed (exit code $code): the sanitizer does not see what it should"
exit 1
