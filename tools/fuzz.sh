#!/usr/bin/env bash
# Fuzzes every boundary for so many seconds each: tools/fuzz.sh [SECONDS] [BOUNDARY...]. Builds what it needs with clang,
# address and undefined-behaviour sanitizers in build/fuzz. The corpus grows in build/fuzz/corpus; an input that crashes,
# hangs or takes too much memory is kept in build/fuzz/found, and the script ends with 1. What each took is added to
# build/fuzz/times.csv.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${LODESTONE_BUILD:-$root/build/fuzz}
seconds=${1:-60}
shift || true
runtime=$(clang --print-file-name=libclang_rt.fuzzer-x86_64.a 2>/dev/null || true)
if ! command -v clang++ >/dev/null || [[ ! -e $runtime ]]; then
  echo "fuzz: clang and its runtime are missing: apt-get install clang libclang-rt-14-dev" >&2
  exit 2
fi
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -gline-tables-only" \
  -DLODESTONE_TESTS=OFF -DLODESTONE_FUZZERS=ON -DLODESTONE_PRECOMPILED_HEADERS=OFF -DLODESTONE_UNITY=ON \
  -DLODESTONE_SANITIZER=fuzzer-no-link,address,undefined >/dev/null
ninja -C "$build" -j"${LODESTONE_JOBS:-$(nproc)}" lodestone_fuzz lodestone_fuzz_seeds
"$build"/fuzz/bin/lodestone_fuzz_seeds "$build/corpus"
mkdir -p "$build/found"
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
failed=0
TIMEFORMAT='%R %U %S'
for corpus in "$build"/corpus/*; do
  name=${corpus##*/}
  [[ $# -gt 0 && ! " $* " == *" $name "* ]] && continue
  log=$build/found/$name.log
  status=0
  { time LODESTONE_BOUNDARY=$name "$build/fuzz/bin/lodestone_fuzz" "$corpus" -max_total_time="$seconds" -timeout=10 \
      -rss_limit_mb=2048 -malloc_limit_mb=1024 -max_len=65536 -artifact_prefix="$build/found/$name-" >"$log" 2>&1; } \
    2>"$log.time" || status=$?
  # Every call adds to these, for a sum over many.
  executions=$(grep -aoE '^#[0-9]+' "$log" | tail -1 | tr -d '#')
  [[ -e $build/times.csv ]] || echo "boundary,clock_s,processor_s,executions" >"$build/times.csv"
  awk -v n="$name" -v e="${executions:-0}" '{ printf "%s,%.0f,%.0f,%s\n", n, $1, $2 + $3, e }' "$log.time" >>"$build/times.csv"
  rm -f "$log.time"
  if ((status == 0)); then
    echo "$name: $(tail -1 "$build/times.csv" | awk -F, '{ print $4 " executions in " $2 " s, " $3 " s of a processor" }'), $(find "$corpus" -type f | wc -l) inputs kept"
  else
    echo "$name: FAILED, see $log"
    failed=1
  fi
done
exit $failed
