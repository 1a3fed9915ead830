#!/usr/bin/env bash
# Sets up a bare Debian 12, builds, and runs the tunnel example: simulate a log with its maps, build the magnetic map
# from the survey drive, localize with three estimators, and compare them in one table.
#
#   tools/demo.sh [FOLDER]          (default: results/tunnel)
#
# LODESTONE_DEMO_DURATION shortens the drive to so many seconds; the whole drive lasts about two and a half minutes.
# LODESTONE_PROGRAM names an installed program; nothing is set up or built then.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=${1:-$root/results/tunnel}
lodestone=${LODESTONE_PROGRAM:-${LODESTONE_BUILD:-$root/build/release}/bin/lodestone}
duration=()
if [[ -n ${LODESTONE_DEMO_DURATION:-} ]]; then duration=(--duration "$LODESTONE_DEMO_DURATION"); fi

step() { printf '\n== %s\n' "$*"; }

if [[ -z ${LODESTONE_PROGRAM:-} ]]; then
  step "Set up and build"
  "$root/tools/setup.sh"
  "$root/tools/build.sh" lodestone
fi

step "Simulate the tunnel (sequence 3): log, ground truth, cloud map, survey drive"
"$lodestone" simulate "$root/config/worlds/tunnel.yaml" --sequence 3 --out "$out" "${duration[@]}"

step "Build the magnetic map from the survey drive"
"$lodestone" map magnetic "$out/survey.bag" --trajectory "$out/survey.tum" --platform "$out/platform.yaml" \
  --out "$out/field.yaml" --force

step "Localize with the smoother, the paper's filter, and the filter without magnetometers"
code=0
"$lodestone" run "$out/log.bag" --platform "$out/platform.yaml" --cloud "$out/cloud.pcd" \
  --magnetic "$out/field.yaml" --initial-pose-from "$out/truth.tum" --truth "$out/truth.tum" \
  --estimator smoother,ieskf,lidar-inertial --out "$out/run" || code=$?
# Exit code 3: an estimator lost track. In a tunnel, this is expected without magnetometers.
if ((code != 0 && code != 3)); then exit "$code"; fi
