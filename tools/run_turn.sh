#!/usr/bin/env bash
# The long checks, in turns that each fit into a run of continuous integration: tools/run_turn.sh [TURN|next|list].
# `next` (the default) is the turn of this commit: the number of commits decides.
#
#   sanitized shards   tools/run_sanitized.sh, see there
#   long               the tests in tests/long_tests.txt, by ctest
#   fuzz-1, fuzz-2     tools/fuzz.sh, a minute for each boundary, half of them in each turn
#   sources            every source compiled alone, without precompiled headers, and clang-tidy for the sources of
#                      recent commits
#
# LODESTONE_SECONDS limits a turn. A turn that does not end in this time is not judged: the script names it and ends
# with 0 the first time, with 1 if the same turn was not judged before on this machine.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
turns=(
  "thread-core thread-factors thread-frontends"
  "address-core"
  "address-factors address-frontends"
  "sources"
  "long"
  "thread-estimators-1 thread-estimators-2"
  "thread-estimators-3 thread-estimators-4"
  "thread-estimators-5 thread-estimators-6"
  "address-estimators-1"
  "address-estimators-2"
  "address-estimators-3"
  "address-estimators-4"
  "address-estimators-5"
  "address-estimators-6"
  "address-estimators-7"
  "address-estimators-8"
  "address-estimators-9"
  "address-estimators-10"
  "address-estimators-11"
  "address-estimators-12"
  "address-estimators-13"
  "address-estimators-14"
  "address-estimators-15"
  "address-estimators-16"
  "fuzz-1"
  "fuzz-2"
  "thread-tools-1 thread-tools-2"
  "thread-tools-3 thread-tools-4"
  "address-tools-1 address-tools-2"
  "address-tools-3 address-tools-4"
  "thread-localization address-localization"
)

# Where the history was cut off, the commit's name stands for the number of commits.
turn_of_commit() {
  local number=0 name
  if [[ $(git -C "$root" rev-parse --is-shallow-repository 2>/dev/null) == false ]]; then
    number=$(git -C "$root" rev-list --count HEAD)
  elif name=$(git -C "$root" rev-parse --verify --quiet HEAD 2>/dev/null); then
    number=$((16#${name:0:7}))
  fi
  echo "${turns[number % ${#turns[@]}]}"
}

# Every source alone: what contributors compile, and what a unity build hides (a missing include).
compile_sources() {
  local build=$root/build/sources
  "$root/tools/setup.sh" clang clang-tidy
  cmake -S "$root" -B "$build" -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_BUILD_TYPE=Debug \
    -DCMAKE_CXX_COMPILER_LAUNCHER= -DLODESTONE_TESTS=ON -DLODESTONE_BENCHMARKS=ON -DLODESTONE_UNITY=OFF \
    -DLODESTONE_PRECOMPILED_HEADERS=OFF >/dev/null
  "$root/tools/compile_sources.py" "$build/compile_commands.json" --tidy 30
}

run() {
  case $1 in
    long)
      "$root/tools/setup.sh"
      "$root/tools/build.sh"
      ctest --test-dir "${LODESTONE_BUILD:-$root/build/release}" -C Long -L long --no-tests=error \
        --output-on-failure -j"$(nproc)"
      ;;
    fuzz-*)
      "$root/tools/setup.sh" clang llvm libclang-rt-14-dev
      LODESTONE_HALF=${1#fuzz-} "$root/tools/fuzz.sh" 60
      ;;
    sources) compile_sources ;;
    *) "$root/tools/run_sanitized.sh" $1 ;;
  esac
}

wanted=${1:-next}
if [[ $wanted == list ]]; then
  printf '%s\n' "${turns[@]}"
  exit
fi
[[ $wanted == next ]] && wanted=$(turn_of_commit)
if [[ -z ${LODESTONE_SECONDS:-} ]]; then
  run "$wanted"
  exit
fi

seconds=$LODESTONE_SECONDS
unset LODESTONE_SECONDS
record=${XDG_STATE_HOME:-$HOME/.local/state}/lodestone/not_judged
status=0
timeout "$seconds" "$0" "$wanted" || status=$?
if ((status != 124)); then
  [[ ! -e $record ]] || sed -i "/^$wanted\$/d" "$record"
  exit "$status"
fi
echo "turn: $wanted: not finished within $seconds s: not judged"
if grep -qxF "$wanted" "$record" 2>/dev/null; then
  echo "turn: $wanted: not judged for the second time: this is a failure" >&2
  exit 1
fi
mkdir -p "${record%/*}"
echo "$wanted" >>"$record"
