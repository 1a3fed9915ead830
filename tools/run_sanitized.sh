#!/usr/bin/env bash
# The test programs under sanitizers: tools/run_sanitized.sh [SHARD...|all|next|list]. `address` is AddressSanitizer with
# LeakSanitizer and UndefinedBehaviorSanitizer, `thread` ThreadSanitizer. A shard is a part of one test program under one of
# them, and builds only the floors that this program links; `next` (the default) is the one whose turn it is at this commit among
# those that are short enough for continuous integration. Builds with clang, which compiles this in half of g++'s time, in
# build/NAME. Ends with 1 at any report, of a child process too, and where a test program does not come to its end.
#
# Whether tests pass is for tools/run_tests.sh to say: here they are named, but clang evaluates arguments in another order
# than g++, so that tests draw other random numbers, and a few that hold statistics to a bound miss it.
# Tests on real data are skipped, unless LODESTONE_DATA names their folder.
#
# LODESTONE_SECONDS: gives up after so many, says so, and ends with 0: then nothing was judged.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
rules=$root/cmake/sanitizers
jobs=${LODESTONE_JOBS:-$(nproc)}

# SANITIZER-PROGRAM, with /OF where a program is run in so many parts. Those of the second list do not take turns in continuous
# integration: their build alone would take most of its time, or nobody has measured it (docs/results/fuzzing.md).
short=(thread-core address-core thread-factors address-factors thread-frontends thread-estimators/6)
long=(address-frontends address-estimators/4 thread-tools/4 address-tools/4)
programs=("${short[@]}" "${long[@]}")
shards=()
for program in "${programs[@]}"; do
  [[ $program != "${long[0]}" ]] || in_turn=${#shards[@]}
  name=${program%%/*}
  if [[ $name == "$program" ]]; then shards+=("$name"); continue; fi
  for ((part = 1; part <= ${program##*/}; ++part)); do shards+=("$name-$part"); done
done

# Round the shards with the number of commits; where history was cut off, by the commit's name.
next_shard() {
  local turn=0
  if [[ $(git -C "$root" rev-parse --is-shallow-repository 2>/dev/null) == false ]]; then
    turn=$(git -C "$root" rev-list --count HEAD)
  elif name=$(git -C "$root" rev-parse --verify --quiet HEAD 2>/dev/null); then
    turn=$((16#${name:0:7}))
  fi
  echo "${shards[turn % in_turn]}"
}

set_up() {
  local missing=()
  [[ -n $(command -v clang++) ]] || missing+=(clang)
  [[ -n $(command -v llvm-symbolizer) ]] || missing+=(llvm)
  [[ -e $(clang --print-file-name=libclang_rt.tsan-x86_64.a 2>/dev/null || true) ]] || missing+=(libclang-rt-14-dev)
  "$root/tools/setup.sh" "${missing[@]}"
}

# Tests of a program that are not run under a sanitizer, with the reason; see the list's own head.
not_run() { awk -v s="$1" -v p="$2" '!/^#/ && ($1 == s || $1 == "both") && $2 == p' "$rules/not_run.txt"; }

report() {
  echo "sanitized: $shard: $1" >&2
  failed=1
}

run_shard() {
  local shard=$1 sanitizer program part=1 parts=1 flags entry
  sanitizer=${shard%%-*}
  program=${shard#*-}
  for entry in "${programs[@]}"; do
    if [[ $entry == */* && $shard == "${entry%%/*}"-* ]]; then
      parts=${entry##*/}
      part=${shard##*-}
      program=${program%-*}
    fi
  done
  flags=$sanitizer
  [[ $sanitizer == address ]] && flags=address,undefined
  local build=$root/build/$sanitizer
  local results=$build/results/$shard
  rm -rf "$results"
  mkdir -p "$results"

  export ASAN_OPTIONS=detect_stack_use_after_return=1:strict_string_checks=1:check_initialization_order=1:log_path=$results/report
  export UBSAN_OPTIONS=print_stacktrace=1:log_path=$results/report
  export LSAN_OPTIONS=suppressions=$rules/leak.supp:print_suppressions=0
  export TSAN_OPTIONS=second_deadlock_stack=1:history_size=4:suppressions=$rules/thread.supp:log_path=$results/report

  export LODESTONE_DATA=${LODESTONE_DATA:-$results/no-data}

  local began=$SECONDS
  cmake -S "$root" -B "$build" -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
    -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -gline-tables-only" \
    -DCMAKE_GTEST_DISCOVER_TESTS_DISCOVERY_MODE=PRE_TEST -DLODESTONE_TESTS=ON -DLODESTONE_UNITY=ON \
    -DLODESTONE_PRECOMPILED_HEADERS=OFF -DLODESTONE_SANITIZER=$flags >"$results/build.log" 2>&1 &&
    ninja -C "$build" -j"$jobs" "lodestone_${program}_tests" >>"$results/build.log" 2>&1 || {
      tail -n 40 "$results/build.log" >&2
      report "not built, see $results/build.log"
      return
    }
  local built=$SECONDS left
  left=$(not_run "$sanitizer" "$program")
  [[ -z $left ]] || awk '{ name = $3; $1 = $2 = $3 = ""; print "  not run: " name ":" $0 }' <<<"$left"

  local filter="*-$(awk '{ printf "%s:", $3 }' <<<"$left")" index log processes=()
  for ((index = 0; index < jobs; ++index)); do
    (cd "$results" && GTEST_TOTAL_SHARDS=$((parts * jobs)) GTEST_SHARD_INDEX=$(((part - 1) * jobs + index)) \
      exec "$build/tests/lodestone_${program}_tests" --gtest_filter="$filter" >"tests-$index.log" 2>&1) &
    processes+=($!)
  done
  for ((index = 0; index < jobs; ++index)); do
    wait "${processes[index]}" || true
    log=$results/tests-$index.log
    grep -qE '^\[==========\] [0-9]+ tests? from .* ran' "$log" || {
      tail -n 20 "$log" >&2
      report "the tests did not come to their end, see $log"
    }
    sed -nE 's/^\[  FAILED  \] ([^ ,]+).* \([0-9]+ ms\)$/  failed, without a report: \1/p' "$log"
  done
  local file
  for file in "$results"/report*; do
    [[ -s $file ]] || continue
    head -n 60 "$file" >&2
    report "a sanitizer has something to say, see $file"
  done
  local counted
  counted=$(grep -hE '^\[  PASSED  \] [0-9]+' "$results"/tests-*.log | awk '{ sum += $4 } END { print sum + 0 }')
  echo "sanitized: $shard: $counted tests passed; built in $((built - began)) s, run in $((SECONDS - built)) s"
}

if [[ ${1:-} == list ]]; then
  printf '%s\n' "${shards[@]}"
  exit
fi
if [[ -n ${LODESTONE_SECONDS:-} ]]; then
  seconds=$LODESTONE_SECONDS
  unset LODESTONE_SECONDS
  status=0
  timeout "$seconds" "$0" "$@" || status=$?
  ((status != 124)) || { echo "sanitized: not finished within $seconds s: nothing was judged" && exit 0; }
  exit "$status"
fi

wanted=("$@")
(($# > 0)) || wanted=(next)
[[ ${wanted[0]} == all ]] && wanted=("${shards[@]}")
[[ ${wanted[0]} == next ]] && wanted=("$(next_shard)")
for shard in "${wanted[@]}"; do
  [[ " ${shards[*]} " == *" $shard "* ]] || {
    echo "sanitized: no shard '$shard'; there are: ${shards[*]}" >&2
    exit 2
  }
done
set_up

# Some kernels and containers do not let a sanitizer's program start at all (its shadow memory has no place): no defect of ours.
starts() {
  local probe
  probe=$(mktemp -d)
  printf 'int main() { return 0; }\n' >"$probe/main.cpp"
  clang++ -fsanitize="$1" "$probe/main.cpp" -o "$probe/main" && "$probe/main" >/dev/null 2>&1
  local status=$?
  rm -rf "$probe"
  return $status
}

failed=0
for shard in "${wanted[@]}"; do
  if starts "${shard%%-*}"; then
    run_shard "$shard"
  else
    echo "sanitized: $shard: programs of this sanitizer do not start on this machine: nothing was judged"
  fi
done
exit $failed
