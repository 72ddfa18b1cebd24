#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the mono3d authors

# Looks for inputs that mono3d's readers do not survive, by libFuzzer (clang), two readers at a time.
#   cmake/fuzz.sh HOURS [TARGET...]   each target so long, all where none is named; 0.5 is half an hour
#   cmake/fuzz.sh 30s                 seconds
#   cmake/fuzz.sh 1000runs            as in CI: the same inputs each time (but for readers that start
#                                     threads), so that what fails is what was changed; nothing is
#                                     learned
# What it learns stays in build/fuzz/corpus/TARGET and is where the next run begins; an input that
# ends a reader lies in build/fuzz/crashes/TARGET, and a minimised one beside it. Ends with a table,
# and with 1 when anything was found. MONO3D_FUZZ_TIMEOUT: seconds that an input may take (10); more
# on a machine that does much else.
set -uo pipefail
cd "$(dirname "$0")/.."

usage() {
  echo "usage: cmake/fuzz.sh HOURS|SECONDSs|Nruns [TARGET...]" >&2
  exit 2
}
[ $# -ge 1 ] || usage
runs=-1  # no limit
case $1 in
  *runs) runs=${1%runs} seconds=120 ;;  # of a reader that has become much slower
  *s) seconds=${1%s} ;;
  *) seconds=$(awk -v hours="$1" 'BEGIN { printf "%d", 3600 * hours }') ;;
esac
[[ $seconds =~ ^[1-9][0-9]*$ && $runs =~ ^(-1|[1-9][0-9]*)$ ]] || usage
shift

all=$(cd tests/fuzz/corpus && ls)
targets=${*:-$all}
for target in $targets; do
  [ -d "tests/fuzz/corpus/$target" ] || { echo "fuzz.sh: no target $target; there are:" $all >&2; exit 2; }
done

cmake --preset fuzz -DMONO3D_UNITY_BUILD=ON >/dev/null && cmake --build --preset fuzz || exit 1

build=$PWD/build/fuzz
# Inputs pass through files: in memory, where there is such a folder.
scratch=$(mktemp -d "$([ -w /dev/shm ] && echo /dev/shm || echo "${TMPDIR:-/tmp}")/mono3d_fuzz.XXXXXX")
trap 'rm -rf "$scratch"' EXIT
export TMPDIR=$scratch
export UBSAN_OPTIONS=print_stacktrace=1
# Memory that cannot be had is an error of the reader, not of the sanitizer; how much may be asked
# for at once is a limit below.
export ASAN_OPTIONS=allocator_may_return_null=1:detect_stack_use_after_return=1:quarantine_size_mb=16
# What a reader prints is none of its results.
limits="-timeout=${MONO3D_FUZZ_TIMEOUT:-10} -rss_limit_mb=2048 -malloc_limit_mb=1024 -max_len=16384 -close_fd_mask=3"

# fuzz_one TARGET: runs until the time is over or an input is found, and then minimises that.
fuzz_one() {
  local target=$1 program=$build/tests/fuzz/mono3d_fuzz log=$build/logs/$1.log
  local corpus=$build/corpus/$target crashes=$build/crashes/$target dictionary found
  local length=(-max_total_time="$seconds")
  if [ "$runs" -gt 0 ]; then
    corpus=$scratch/corpus/$target
    # What is learned from comparisons depends on addresses and on the names of folders: readers
    # that start threads aside, the inputs are then the same each time.
    length+=(-runs="$runs" -seed=1 -use_cmp=0)
    program="setarch -R $program"
  fi
  mkdir -p "$corpus" "$crashes" "$build/logs"
  dictionary=tests/fuzz/dictionaries/$target.dict
  # shellcheck disable=SC2086  # the program and the limits are meant to be split
  $program --target="$target" $limits "${length[@]}" -print_final_stats=1 -dict="$dictionary" \
    -artifact_prefix="$crashes/" "$corpus" "tests/fuzz/corpus/$target" >"$log" 2>&1
  [ $? -ne 0 ] || return 0
  found=$(sed -n 's/.*Test unit written to //p' "$log" | tail -1)
  case $found in
    *crash-*)
      # shellcheck disable=SC2086
      $program --target="$target" $limits -minimize_crash=1 -runs=20000 -max_total_time=60 \
        -exact_artifact_path="$found.min" "$found" >"$log.min" 2>&1
      ;;
  esac
  return 1
}
export -f fuzz_one
export build scratch seconds runs limits

# shellcheck disable=SC2086
printf '%s\n' $targets | xargs -P 2 -I{} bash -c 'fuzz_one {}'

status=0
printf '%-12s %8s %12s %10s %10s  %s\n' target seconds executions coverage 'new units' found
for target in $targets; do
  log=$build/logs/$target.log
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -1)
  added=$(sed -n 's/^stat::new_units_added: *//p' "$log" | tail -1)
  coverage=$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$log" | tail -1)
  time=$(sed -n 's/^Done [0-9]* runs in \([0-9]*\) second.*/\1/p' "$log" | tail -1)
  # A target that was ended by an input tells the number of executions alone before it.
  : "${executions:=$(sed -n 's/^#\([0-9]*\)\t.*/\1/p' "$log" | tail -1)}"
  found=$(sed -n 's/.*Test unit written to //p' "$log" | tail -1)
  [ -z "$found" ] && [ -n "$time" ] || status=1
  why=$(grep -m 1 -oE '(ERROR: (AddressSanitizer|libFuzzer|LeakSanitizer)|runtime error):? .{0,80}' "$log")
  printf '%-12s %8s %12s %10s %10s  %s\n' "$target" "${time:--}" "${executions:-0}" "${coverage:-0}" \
    "${added:--}" "${found:+$found: }${why:-$([ -n "$time" ] && echo nothing || echo "did not run, see $log")}"
done
exit "$status"
