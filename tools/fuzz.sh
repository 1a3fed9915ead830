#!/usr/bin/env bash
# Fuzzes every boundary: tools/fuzz.sh [SECONDS] [BOUNDARY...]. SECONDS (60) is the time for each boundary. As many
# boundaries run at once as there are processors (or LODESTONE_JOBS). The fuzzer is built with clang and its address
# and undefined-behaviour sanitizers in build/fuzz. The corpus grows in build/fuzz/corpus. Inputs that crash, hang or
# need too much memory stay in build/fuzz/found; the script then ends with 1. Each boundary adds its time to
# build/fuzz/times.csv. LODESTONE_HALF, 1 or 2: every second boundary only.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${LODESTONE_BUILD:-$root/build/fuzz}
jobs=${LODESTONE_JOBS:-$(nproc)}
seconds=${1:-60}
shift || true
runtime=$(clang --print-file-name=libclang_rt.fuzzer-x86_64.a 2>/dev/null || true)
if ! command -v clang++ >/dev/null || [[ ! -e $runtime ]]; then
  echo "fuzz: clang and its runtime are missing: apt-get install clang libclang-rt-14-dev" >&2
  exit 2
fi

# fuzz_one CORPUS: prints one line; returns 1 if the fuzzer found something.
fuzz_one() {
  local corpus=$1 name=${1##*/} status=0 executions times
  local log=$build/found/$name.log
  TIMEFORMAT='%R %U %S'
  { time LODESTONE_BOUNDARY=$name "$build/fuzz/bin/lodestone_fuzz" "$corpus" -max_total_time="$seconds" -timeout=10 \
      -rss_limit_mb=2048 -malloc_limit_mb=1024 -max_len=65536 -artifact_prefix="$build/found/$name-" >"$log" 2>&1; } \
    2>"$log.time" || status=$?
  executions=$(grep -aoE '^#[0-9]+' "$log" | tail -1 | tr -d '#')
  times=$(awk -v e="${executions:-0}" '{ printf "%.0f,%.0f,%s", $1, $2 + $3, e }' "$log.time")
  rm -f "$log.time"
  echo "$name,$times" >>"$build/times.csv"
  if ((status != 0)); then
    echo "$name: FAILED, see $log"
    return 1
  fi
  awk -F, -v n="$name" -v k="$(find "$corpus" -type f | wc -l)" \
    '{ print n ": " $3 " executions in " $1 " s, " $2 " s of a processor, " k " inputs kept" }' <<<"$times"
}

if [[ ${LODESTONE_FUZZ_ONE:-} ]]; then
  fuzz_one "$LODESTONE_FUZZ_ONE"
  exit
fi

cmake -S "$root" -B "$build" -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -gline-tables-only" \
  -DLODESTONE_TESTS=OFF -DLODESTONE_FUZZERS=ON -DLODESTONE_PRECOMPILED_HEADERS=OFF -DLODESTONE_UNITY=ON \
  -DLODESTONE_SANITIZER=fuzzer-no-link,address,undefined >/dev/null
ninja -C "$build" -j"$jobs" lodestone_fuzz lodestone_fuzz_seeds
"$build"/fuzz/bin/lodestone_fuzz_seeds "$build/corpus"
mkdir -p "$build/found"
[[ -e $build/times.csv ]] || echo "boundary,clock_s,processor_s,executions" >"$build/times.csv"
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
corpora=()
number=0
for corpus in "$build"/corpus/*; do
  number=$((number + 1))
  [[ -z ${LODESTONE_HALF:-} || $((number % 2)) == $((LODESTONE_HALF % 2)) ]] || continue
  [[ $# -gt 0 && ! " $* " == *" ${corpus##*/} "* ]] || corpora+=("$corpus")
done
if ((${#corpora[@]} == 0)); then
  echo "fuzz: no boundary is called $*; there are: $(ls "$build/corpus" | tr '\n' ' ')" >&2
  exit 2
fi
status=0
printf '%s\n' "${corpora[@]}" |
  xargs -P "$jobs" -I{} env LODESTONE_FUZZ_ONE={} LODESTONE_BUILD="$build" "${BASH_SOURCE[0]}" "$seconds" || status=1
exit $status
