#!/usr/bin/env bash
# Fuzzes every boundary for so many seconds each: tools/fuzz.sh [SECONDS] [BOUNDARY...]. Builds what it needs with clang,
# address and undefined-behaviour sanitizers in build/fuzz. The corpus grows in build/fuzz/corpus; an input that crashes,
# hangs or takes too much memory is kept in build/fuzz/found, and the script ends with 1.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${LODESTONE_BUILD:-$root/build/fuzz}
seconds=${1:-60}
shift || true
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DLODESTONE_TESTS=OFF -DLODESTONE_FUZZERS=ON -DLODESTONE_PRECOMPILED_HEADERS=OFF \
  -DLODESTONE_SANITIZER=fuzzer-no-link,address,undefined >/dev/null
ninja -C "$build" -j"${LODESTONE_JOBS:-$(nproc)}" lodestone_fuzzers
"$build"/fuzz/bin/lodestone_fuzz_seeds "$build/corpus"
mkdir -p "$build/found"
failed=0
for fuzzer in "$build"/fuzz/bin/lodestone_fuzz_*; do
  name=${fuzzer##*/lodestone_fuzz_}
  [[ $name == seeds ]] && continue
  [[ $# -gt 0 && ! " $* " == *" $name "* ]] && continue
  log=$build/found/$name.log
  if "$fuzzer" "$build/corpus/$name" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=1024 \
      -max_len=65536 -artifact_prefix="$build/found/$name-" -verbosity=1 >"$log" 2>&1; then
    echo "$name: $(grep -oE 'Done [0-9]+ runs in [0-9]+ second' "$log" | tail -1)s, $(ls "$build/corpus/$name" | wc -l) inputs kept"
  else
    echo "$name: FAILED, see $log"
    failed=1
  fi
done
exit $failed
