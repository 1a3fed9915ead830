#!/usr/bin/env bash
# The test programs under sanitizers: tools/run_sanitized.sh SHARD...|all|list. `address` is AddressSanitizer with
# LeakSanitizer and UndefinedBehaviorSanitizer, `thread` ThreadSanitizer. A shard is a part of one test program under
# one sanitizer. Its build contains only the layers that the program links. The compiler is clang, which needs half of
# the time of g++; the folder is build/SANITIZER. The script ends with 1 if a sanitizer reports something, in child
# processes too, or if a test program does not end.
#
# A failed test is named but does not count; tools/run_tests.sh judges tests. clang evaluates arguments in another
# order than g++, so tests draw other random numbers, and a few statistics miss their bounds. Tests on real data are
# skipped, unless LODESTONE_DATA names their folder. Long tests (tests/long_tests.txt) do not run.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
rules=$root/cmake/sanitizers
jobs=${LODESTONE_JOBS:-$(nproc)}

# SANITIZER-PROGRAM, with /PARTS if the program is divided.
programs=(thread-core address-core thread-factors address-factors thread-frontends address-frontends
  thread-estimators/6 address-estimators/16 thread-localization address-localization
  thread-tools/4 address-tools/4)
shards=()
for program in "${programs[@]}"; do
  name=${program%%/*}
  if [[ $name == "$program" ]]; then shards+=("$name"); continue; fi
  for ((part = 1; part <= ${program##*/}; ++part)); do shards+=("$name-$part"); done
done

set_up() {
  local missing=()
  [[ -n $(command -v clang++) ]] || missing+=(clang)
  [[ -n $(command -v llvm-symbolizer) ]] || missing+=(llvm)
  [[ -e $(clang --print-file-name=libclang_rt.tsan-x86_64.a 2>/dev/null || true) ]] || missing+=(libclang-rt-14-dev)
  "$root/tools/setup.sh" "${missing[@]}"
}

# Tests of a program that do not run under a sanitizer.
not_run() { awk -v p="$1" '$1 == p { print $2 }' "$root/tests/long_tests.txt"; }

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

  export ASAN_OPTIONS=detect_stack_use_after_return=1:strict_string_checks=1:check_initialization_order=1
  ASAN_OPTIONS+=:log_path=$results/report
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
  left=$(not_run "$program")
  [[ -z $left ]] || sed 's/^/  not run: /' <<<"$left"

  local filter="*-${left//$'\n'/:}" index log processes=()
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
    report "a sanitizer has a report, see $file"
  done
  local counted
  counted=$(grep -hE '^\[  PASSED  \] [0-9]+' "$results"/tests-*.log | awk '{ sum += $4 } END { print sum + 0 }')
  echo "sanitized: $shard: $counted tests passed; built in $((built - began)) s, run in $((SECONDS - built)) s"
}

if [[ ${1:-} == list ]]; then
  printf '%s\n' "${shards[@]}"
  exit
fi
wanted=("$@")
[[ ${wanted[0]:-} == all ]] && wanted=("${shards[@]}")
if ((${#wanted[@]} == 0)); then
  echo "sanitized: name one or more shards, or all; there are: ${shards[*]}" >&2
  exit 2
fi
for shard in "${wanted[@]}"; do
  [[ " ${shards[*]} " == *" $shard "* ]] || {
    echo "sanitized: no shard '$shard'; there are: ${shards[*]}" >&2
    exit 2
  }
done
set_up

# In some kernels and containers no program of a sanitizer starts, because its shadow memory has no place.
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
    echo "sanitized: $shard: programs of this sanitizer do not start on this machine: not judged"
  fi
done
exit $failed
