#!/usr/bin/env bash
# Configures and builds everything in build/release (or the folder in LODESTONE_BUILD). Arguments go to ninja.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${LODESTONE_BUILD:-$root/build/release}

# With precompiled headers, ccache must ignore these differences.
export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros}

# A new build folder compiles sources together, which is faster. An existing folder keeps its configuration.
unity=()
[[ -e $build/CMakeCache.txt ]] || unity=(-DLODESTONE_UNITY="${LODESTONE_UNITY:-ON}")

cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DLODESTONE_TESTS=ON \
  -DLODESTONE_BENCHMARKS=ON "${unity[@]}" >/dev/null
ninja -C "$build" -j"$(nproc)" "$@"
