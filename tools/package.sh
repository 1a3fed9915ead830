#!/usr/bin/env bash
# Builds the Debian packages lodestone, liblodestone-dev and python3-lodestone, and tests them by autopkgtest in a clean
# Debian 12 (tests/package): a short demo, the demo's drive from Python, and the library's example.
#
#   tools/package.sh [FOLDER] [TEST...]       (default: build/packages, all tests)
#
# A clean Debian requires root, debootstrap and autopkgtest (tools/setup.sh debootstrap autopkgtest) and a package
# mirror (LODESTONE_MIRROR; default: that of this machine). Without these, the packages are only unpacked for the demo,
# and their dependencies are not tested.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${LODESTONE_BUILD:-$root/build/release}
mkdir -p "${1:-$root/build/packages}"
out=$(cd "${1:-$root/build/packages}" && pwd)
tests=("${@:2}")

step() { printf '\n== %s\n' "$*"; }

# LODESTONE_PACKAGE_BUILT: the build folder is complete.
if [[ -z ${LODESTONE_PACKAGE_BUILT:-} ]]; then
  "$root/tools/setup.sh" dpkg-dev
  "$root/tools/build.sh" lodestone lodestone_localization lodestone_python
fi

step "Packages"
rm -f "$out"/*.deb
(cd "$build" && cpack -G DEB -B "$out" >"$out/cpack.log") || { cat "$out/cpack.log" >&2; exit 1; }
rm -rf "$out/_CPack_Packages"
program=$(echo "$out"/lodestone_*.deb)
module=$(echo "$out"/python3-lodestone_*.deb)
ls -l "$out"/*.deb
dpkg-deb --field "$program" Package Version Depends
dpkg-deb --field "$module" Package Version Depends

clean=$(mktemp -d)
trap 'rm -rf "$clean"' EXIT
if ((EUID == 0)) && [[ -n $(command -v debootstrap) && -n $(command -v autopkgtest) ]]; then
  step "A clean Debian 12"
  mirror=${LODESTONE_MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | head -1)}
  debootstrap --variant=minbase bookworm "$clean/system" "$mirror" >"$out/debootstrap.log"
  mkdir "$clean/source"
  (cd "$root" && git ls-files -z | xargs -0 cp --parents -t "$clean/source")
  cp -r "$root/tests/package/debian" "$clean/source/"
  # The program reads /proc; the mount ends with the command.
  rm -rf "$out/autopkgtest"
  unshare --mount bash -c 'mount -t proc proc "$0/system/proc" && exec "$@"' "$clean" \
    autopkgtest --no-built-binaries --env "LODESTONE_DEMO_DURATION=${LODESTONE_DEMO_DURATION:-10}" \
    "${tests[@]/#/--test-name=}" --output-dir "$out/autopkgtest" \
    "$out"/*.deb "$clean/source" -- chroot "$clean/system"
else
  step "Not tested: installation and dependencies, which require root, debootstrap and autopkgtest. Unpacked only."
  dpkg-deb -x "$program" "$clean"
  dpkg-deb -x "$module" "$clean"
  # The demo finds its worlds beside itself, in share/lodestone.
  install -D "$root/tools/demo.sh" "$clean/usr/share/lodestone/tools/demo.sh"
  step "Version"
  "$clean/usr/bin/lodestone" --version
  step "Demo"
  LODESTONE_PROGRAM="$clean/usr/bin/lodestone" LODESTONE_DEMO_DURATION="${LODESTONE_DEMO_DURATION:-10}" \
    bash "$clean/usr/share/lodestone/tools/demo.sh" "$clean/demo"
  step "Python: the demo's trajectory again"
  PYTHONPATH="$clean/usr/lib/python3/dist-packages" /usr/bin/python3 "$root/tests/python/demo_drive.py" "$clean/demo"
fi
step "The packages are in $out"
