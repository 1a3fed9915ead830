#!/usr/bin/env bash
# Installs the packages of third_party/packages.txt, and those given as arguments, on Debian 12. Never asks; does
# nothing if all are installed. Requires root or sudo.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# Skip a package whose command already works: Debian's package could conflict with it (for example Node).
packages=("$@")
while IFS='|' read -r name _ _ _ command; do
  read -r name <<<"$name" || continue
  read -r command <<<"$command" || true
  if [[ -n $command ]] && "$command" --version >/dev/null 2>&1; then continue; fi
  packages+=("$name")
done < <(sed -e 's/#.*//' "$root/third_party/packages.txt" | grep '[^[:space:]]')
installed=$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' "${packages[@]}" 2>/dev/null |
  awk '$2 == "installed" { print $1 }') || true
missing=()
for package in "${packages[@]}"; do
  grep -qxF -- "$package" <<<"$installed" || missing+=("$package")
done
if ((${#missing[@]} == 0)); then
  echo "setup: all ${#packages[@]} packages are installed"
  exit 0
fi

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "setup: run this script as root to install packages: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
echo "setup: installing ${#missing[@]} packages and their dependencies: ${missing[*]}"
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=600 -o Acquire::Retries=3)
"${apt[@]}" update
"${apt[@]}" install --yes --no-install-recommends -o Dpkg::Use-Pty=0 "${missing[@]}" >/dev/null
echo "setup: done"
