#!/bin/bash
# usage: maintainer_scripts_test.sh SOURCE_DIR: install, upgrade, remove and purge keep what people made. The scripts run in a mount
# namespace of their own, above the machine's /etc, /var and /usr, which stay as they are.
set -euo pipefail
source_dir=$1
if [ "${2:-}" != inside ]; then
  unshare -rm true 2>/dev/null || { echo "skipped: no user and mount namespaces here"; exit 77; }
  scratch=$(mktemp -d)
  trap 'rm -rf "$scratch" 2>/dev/null || true' EXIT
  unshare -rm "$0" "$source_dir" inside "$scratch" || exit $?
  exit 0
fi
scratch=$3
mount -t tmpfs tmpfs "$scratch"
for folder in etc var usr; do
  mkdir -p "$scratch/$folder/upper" "$scratch/$folder/work"
  if ! mount -t overlay overlay -o "lowerdir=/$folder,upperdir=$scratch/$folder/upper,workdir=$scratch/$folder/work" "/$folder"; then
    echo "skipped: no overlays in a user namespace here"
    exit 77
  fi
done

# What the scripts call and must not do here: each call is noted instead.
mkdir -p "$scratch/bin"
for program in systemd-sysusers systemctl deb-systemd-invoke deb-systemd-helper udevadm; do
  printf '#!/bin/sh\necho "%s $*" >> %s/calls\n' "$program" "$scratch" > "$scratch/bin/$program"
  chmod +x "$scratch/bin/$program"
done
export PATH=$scratch/bin:$PATH
scripts=$source_dir/cmake/debian
failures=0
check() {
  if ! eval "$2"; then
    echo "FAILED: $1"
    failures=$((failures + 1))
  else
    echo "ok: $1"
  fi
}
rm -rf /etc/posed /var/lib/posed
mkdir -p /usr/share/posed
cp "$source_dir/systemd/default.toml" /usr/share/posed/default.toml

sh "$scripts/postinst" configure ''
check "the first installation makes a configuration" 'cmp -s /etc/posed/posed.toml /usr/share/posed/default.toml'
check "it makes the user" 'grep -q "^systemd-sysusers posed.conf" "$scratch/calls"'
check "it starts nothing" '! grep -qE "restart|start" "$scratch/calls"'

sh "$scripts/prerm" remove
check "a configuration that nobody changed goes with the package" 'test ! -e /etc/posed/posed.toml'
sh "$scripts/postrm" purge >"$scratch/out"
check "a purge leaves nothing of it" 'test ! -e /etc/posed'

sh "$scripts/postinst" configure ''
echo '# mine' >> /etc/posed/posed.toml
mkdir -p /var/lib/posed
echo map > /var/lib/posed/map
sh "$scripts/prerm" upgrade 0.2.0
echo '# new defaults' >> /usr/share/posed/default.toml
sh "$scripts/postinst" configure 0.1.0
check "an upgrade keeps the configuration" 'grep -q "^# mine" /etc/posed/posed.toml'
check "an upgrade keeps the maps" 'test "$(cat /var/lib/posed/map)" = map'
sh "$scripts/prerm" remove
sh "$scripts/postrm" remove
sh "$scripts/postrm" purge >"$scratch/out"
check "a purge keeps a changed configuration" 'grep -q "^# mine" /etc/posed/posed.toml'
check "a purge keeps the maps" 'test "$(cat /var/lib/posed/map)" = map'
check "and says so" 'grep -q /etc/posed "$scratch/out" && grep -q /var/lib/posed "$scratch/out"'
exit $((failures > 0))
