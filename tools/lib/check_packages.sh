#!/bin/bash
# Are the packages that tools/ installs those that docs/dependencies.md lists? Says which differ; exit status 1 where some do.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
source tools/lib/packages.sh

installed=$(printf '%s\n' "${posed_build_packages[@]%%|*}" "${posed_demo_packages[@]%%|*}" "${posed_package_packages[@]%%|*}" "${posed_fuzz_packages[@]%%|*}" "${posed_test_packages[@]%%|*}" \
  "${posed_vm_packages[@]%%|*}" | LC_ALL=C sort -u)
# The first cell of a table's row, where it is a name in backquotes.
# shellcheck disable=SC2016
documented=$(sed -n 's/^| `\([a-z0-9.+-]*\)` |.*/\1/p' docs/dependencies.md | LC_ALL=C sort -u)
undocumented=$(LC_ALL=C comm -23 <(echo "$installed") <(echo "$documented"))
unlisted=$(LC_ALL=C comm -13 <(echo "$installed") <(echo "$documented"))
if [ -n "$undocumented$unlisted" ]; then
  [ -z "$undocumented" ] || printf 'not in docs/dependencies.md: %s\n' "${undocumented//$'\n'/ }" >&2
  [ -z "$unlisted" ] || printf 'not in tools/lib/packages.sh: %s\n' "${unlisted//$'\n'/ }" >&2
  exit 1
fi
echo "$(wc -l <<<"$installed") packages, the same in both."
