#!/usr/bin/env bash
# Builds the Debian packages lodestone, liblodestone-dev and python3-lodestone, installs lodestone and python3-lodestone
# into a clean Debian 12, and runs `lodestone --version`, a short demo, and the demo's drive from Python there.
#
#   tools/package.sh [FOLDER]       (default: build/packages)
#
# A clean Debian requires root, debootstrap (tools/setup.sh debootstrap) and a package mirror (LODESTONE_MIRROR;
# default: that of this machine). Without these, the package is only unpacked, and its dependencies are not tested.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${LODESTONE_BUILD:-$root/build/release}
mkdir -p "${1:-$root/build/packages}"
out=$(cd "${1:-$root/build/packages}" && pwd)

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

# The demo finds its worlds beside itself, in share/lodestone.
clean=$(mktemp -d)
trap 'rm -rf "$clean"' EXIT
demo=usr/share/lodestone/tools/demo.sh
if ((EUID == 0)) && [[ -n $(command -v debootstrap) ]]; then
  step "A clean Debian 12"
  mirror=${LODESTONE_MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | head -1)}
  debootstrap --variant=minbase bookworm "$clean" "$mirror" >"$out/debootstrap.log"
  cp "$program" "$clean/tmp/lodestone.deb"
  cp "$module" "$clean/tmp/python3-lodestone.deb"
  # The program reads /proc; the mount ends with the command.
  inside() {
    unshare --mount bash -c 'mount -t proc proc "$0/proc" && exec chroot "$0" "$@"' \
      "$clean" env LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"
  }
  inside apt-get -qq install --yes --no-install-recommends -o Dpkg::Use-Pty=0 -o Dpkg::Options::=--force-unsafe-io \
    /tmp/lodestone.deb /tmp/python3-lodestone.deb >"$out/install.log"
  folder=/
else
  step "Not tested: installation and dependencies, which require root and debootstrap. The package is only unpacked."
  dpkg-deb -x "$program" "$clean"
  dpkg-deb -x "$module" "$clean"
  mkdir -p "$clean/tmp"
  inside() { "$@"; }
  folder=$clean/
fi
install -D "$root/tools/demo.sh" "$clean/$demo"

step "Version"
inside "${folder}usr/bin/lodestone" --version
step "Demo"
inside env LODESTONE_PROGRAM="${folder}usr/bin/lodestone" LODESTONE_DEMO_DURATION="${LODESTONE_DEMO_DURATION:-10}" \
  bash "$folder$demo" "${folder}tmp/demo"
step "Python: the demo's trajectory again"
install "$root/tests/python/demo_drive.py" "$clean/tmp/demo_drive.py"
inside env PYTHONPATH="${folder}usr/lib/python3/dist-packages" /usr/bin/python3 \
  "${folder}tmp/demo_drive.py" "${folder}tmp/demo"
step "The packages are in $out"
