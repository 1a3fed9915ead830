#!/usr/bin/env bash
# Sets up a bare Debian 12, builds, and runs the tests, except those in tests/long_tests.txt. ctest has the last word.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${LODESTONE_BUILD:-$root/build/release}

"$root/tools/setup.sh"
"$root/tools/build.sh"
exec ctest --test-dir "$build" --output-on-failure -j"$(nproc)"
