#!/usr/bin/env bash
# Checks the documentation and builds it as a site: tools/docs.sh [--check]. The site is build/docs/site/index.html,
# with the API reference. --check only checks the pages and requires only Python. The exit code is 1 after any finding
# or warning.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"

# Sentences, sizes, links and anchors.
tools/check_docs.py
[[ ${1:-} != --check ]] || exit 0

set_up() {
  local missing=()
  [[ -n $(command -v doxygen) ]] || missing+=(doxygen)
  [[ -n $(command -v mkdocs) ]] || missing+=(mkdocs)
  [[ $(mkdocs build --help 2>/dev/null) == *material* ]] || missing+=(mkdocs-material)
  ((${#missing[@]} == 0)) || "$root/tools/setup.sh" "${missing[@]}"
}
set_up

build=build/docs
rm -rf "$build"
mkdir -p "$build/source"
cp -r docs "$build/source/"
while read -r file; do cp --parents "$file" "$build/source/"; done < <(tools/check_docs.py --linked-files)
cp README.md "$build/source/"

# Warnings of Doxygen and mkdocs are errors.
doxygen docs/Doxyfile
mkdocs --quiet build --strict
cp -r "$build/api/html" "$build/site/api"
tools/check_docs.py --site "$build/site"
echo "docs: $root/$build/site/index.html"
