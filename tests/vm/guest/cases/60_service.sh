# shellcheck shell=bash disable=SC2154  # variables of lib.sh
# The service as the package installs it: its own unit, user, folders and rules.

unit_property() { systemctl show posed --property="$1" --value; }
is_another() { unit_is active && [ "$(unit_property MainPID)" != "$1" ]; } # than the process of before
unit_is() { [ "$(unit_property ActiveState)" = "$1" ]; }

# expect_journal PATTERN: the service says so soon, or has said so since the case began.
expect_journal() { wait_until journal_has "$1" || fail "the service does not log '$1'"; }
journal_has() { journal_of_service | grep -E -- "$1"; }

# configure_service: the administrator's configuration: two cameras by V4L2, lines, a map, real time. What comes on standard input goes
# into the table source.v4l2.
configure_service() {
  write_v4l2_config yuyv
  cat >>case.toml <<'END'

[map]
file = "/var/lib/posed/map"

[pipeline]
lock_memory = true

[pipeline.capture]
policy = "fifo"
priority = 30

[logging]
level = "info"
END
  cp camera.toml case.toml /etc/posed/
  mv /etc/posed/case.toml /etc/posed/posed.toml
  chmod 644 /etc/posed/*.toml
}

start_service() {
  plug_cameras
  configure_service <<<"$squares"
  systemctl start posed || fail "systemd does not start it"
  unit_is active || fail "it is $(unit_property ActiveState)"
}

# stop_service: systemd takes it for a success; how long it took is in the case's log.
stop_service() {
  local -r began_ms=$(date +%s%3N)
  systemctl stop posed
  echo "stopped in $(($(date +%s%3N) - began_ms)) ms"
  [ "$(unit_property Result)" = success ] || fail "its end is taken for a failure: $(unit_property Result)"
}

# The package's unit, user, groups, rules and limits are in place, and what it installed has not been changed.
case_service_installed() {
  systemctl cat posed.service >/dev/null
  systemd-analyze verify --man=no posed.service
  id posed | tee /dev/stderr | grep -q video
  id posed | grep -q gpio
  [ -e /etc/posed/posed.toml ] || fail "there is no configuration"
  [ "$(sysctl -n net.core.rmem_max)" -ge 2097152 ] || fail "LCM's receive buffers stay small: $(sysctl -n net.core.rmem_max)"
  dpkg --verify posed posed-tools | tee /dev/stderr | grep -v ' /usr/share/\(doc\|man\)/' >changed || true # the image leaves these out
  [ ! -s changed ] || fail "files of the package are missing or changed"
  posectl doctor || true # what it finds is for the log
}

# The unit becomes ready with the cameras, runs as its own user, keeps its map where it may write, and nowhere else; stops when asked.
case_service_runs() {
  start_service
  expect_poses 10
  [ "$(ps -o user= -p "$(unit_property MainPID)")" = posed ] || fail "it does not run as posed"
  [ -n "$(unit_property StatusText)" ] || fail "it says nothing of its status"
  ps -L -o comm=,cls=,rtprio= -p "$(unit_property MainPID)" | tee /dev/stderr | grep -Eq '^capture +FF +30' || fail "no real time"
  ! journal_has 'lock_memory|cannot lock' || fail "memory is not locked"
  echo "memory: now $(unit_property MemoryCurrent), at most $(unit_property MemoryMax) bytes; tasks $(unit_property TasksCurrent)"
  [ "$(unit_property MemoryCurrent)" -lt "$(unit_property MemoryMax)" ] || fail "no ceiling on its memory"
  stop_service
  expect_journal 'stopping: SIGTERM'
  [ -s /var/lib/posed/map ] || fail "there is no map in /var/lib/posed"
  [ "$(stat -c %U /var/lib/posed/map)" = posed ] || fail "the map is not posed's"
}

# A camera that is not there: the unit is ready nevertheless, says that it waits, and stops within its time.
case_service_without_camera() {
  configure_service <<<"$squares"
  systemctl start posed || fail "systemd does not take it for started"
  expect_journal 'waiting for the camera'
  unit_is active || fail "it is $(unit_property ActiveState)"
  stop_service
  systemctl start posed
  plug_cameras
  expect_poses 3
  stop_service
}

# A thread that hangs, here all of them (SIGSTOP): the watchdog is not fed, and systemd kills and restarts the service, which publishes
# poses again with the map it had.
case_service_watchdog() {
  start_service
  expect_poses 5
  systemctl kill --signal=USR1 posed # saves the map
  wait_until test -s /var/lib/posed/map || fail "SIGUSR1 saves no map"
  local -r before=$(unit_property MainPID)
  kill -STOP "$before"
  wait_until is_another "$before" || fail "it was not restarted"
  expect_journal 'Watchdog timeout'
  expect_poses 5
  stop_service
}

# Killed, it is restarted at once; the configuration being wrong, it is not, and its state is 'failed' with status 78.
case_service_restarts() {
  start_service
  expect_poses 3
  local -r before=$(unit_property MainPID)
  systemctl kill --signal=KILL posed
  wait_until is_another "$before" || fail "it was not restarted"
  expect_poses 3
  stop_service
  sed -i 's/^rate_hz.*/rate_hz = "fast"/' /etc/posed/posed.toml
  ! systemctl start posed 2>/dev/null || fail "it starts with a wrong configuration"
  [ "$(unit_property ExecMainStatus)" = 78 ] || fail "its exit status is $(unit_property ExecMainStatus)"
  sleep 3
  unit_is failed || fail "it is $(unit_property ActiveState), not failed"
  expect_journal 'posed.toml:[0-9]+.*rate_hz'
}

# The cameras are unplugged while the service runs, and plugged in again.
case_service_unplugged() {
  start_service
  expect_poses 3
  local -r before=$(unit_property MainPID)
  unplug_cameras
  expect_journal 'source: no frames; waiting for the camera'
  sleep 8 # longer than the watchdog's period: waiting is progress
  plug_cameras_again
  expect_journal 'source: frames come'
  expect_poses 3
  [ "$(unit_property MainPID)" = "$before" ] || fail "it was restarted"
  stop_service
}

# A firewall that lets nothing in: the daemon cannot be asked for anything, says so, and publishes; `posectl watch` says so, too.
case_service_firewalled() {
  plug_cameras
  configure_service <<<"$squares"
  mkdir -p /run/systemd/system/posed.service.d
  printf '[Service]\nIPAddressDeny=any\nIPAddressAllow=multicast\n' >/run/systemd/system/posed.service.d/firewall.conf
  systemctl daemon-reload
  systemctl start posed || fail "systemd does not start it"
  expect_journal 'LCM receives nothing'
  expect_poses 10
  [ "$(unit_property NRestarts)" = 0 ] || fail "it was restarted"
  ! systemd-run --quiet --unit=posed-case --service-type=oneshot --property=IPAddressDeny=any --property=IPAddressAllow=multicast \
    --property=StandardError=file:/run/case/watch.log /usr/bin/posectl watch --count 1 || fail "posectl watch takes it for success"
  [ "$(systemctl show posed-case --property=ExecMainStatus --value)" = 69 ] || fail "posectl watch ends with another status than 69"
  grep -q 'LCM receives nothing' watch.log || fail "posectl watch does not say why"
  stop_service
}

has_line() { gpioinfo "$gpio_chip" | grep -E 'line +0:.*posed'; }

# GPIO lines work under the unit's confinement.
case_service_lines() {
  plug_gpio
  pull 3 up
  plug_cameras
  configure_service <<<"$squares"
  printf '\n[gpio]\nchip = "robot"\nstatus_line = 0\nenable_line = 3\n' >>/etc/posed/posed.toml
  systemctl start posed || fail "systemd does not start it"
  expect_poses 3
  wait_until has_line || fail "the line is not taken"
  stop_service
}

# A reload takes what may change while it runs, names what may not, and refuses a file with mistakes; poses go on.
case_service_reloads() {
  start_service
  expect_poses 3
  local -r before=$(unit_property MainPID)
  sed -i 's/^level = "info"/level = "debug"/; s/^features.*/features = 400/' /etc/posed/posed.toml
  systemctl reload posed
  expect_journal 'tracker.features.*restart|restart.*tracker.features'
  expect_journal 'logging.level'
  echo 'no_such_key = 1' >>/etc/posed/posed.toml
  systemctl reload posed
  expect_journal 'no_such_key'
  expect_poses 3
  [ "$(unit_property MainPID)" = "$before" ] || fail "it was restarted"
  stop_service
}

told_again() { [ "$(journal_of_service | grep -c 'page faults')" -ge 3 ]; }

# With its memory locked, neither capture nor tracking faults on a page once it is warm.
case_service_page_faults() {
  start_service
  expect_journal 'page faults' # told every 30 s
  wait_until told_again || fail "the status is not told again"
  journal_of_service | grep -o 'page faults.*' | tee told
  [ "$(head -n 1 told)" = "$(tail -n 1 told)" ] || fail "$(head -n 1 told), and later $(tail -n 1 told)"
  stop_service
}

# An upgrade goes on as before, with the administrator's configuration and the map; a removal stops the service and leaves both; so does a
# purge, and says so.
case_service_upgraded_and_purged() {
  start_service
  expect_poses 3
  local -r before=$(unit_property MainPID)
  cp /etc/posed/posed.toml mine.toml
  dpkg --install /run/posed-vm/packages/posed_*.deb
  wait_until is_another "$before" || fail "the upgrade does not restart it"
  cmp mine.toml /etc/posed/posed.toml || fail "the upgrade changed the configuration"
  expect_poses 3
  dpkg --remove posed-tools posed
  ! pgrep -x posed || fail "it still runs"
  [ -s /var/lib/posed/map ] || fail "the map is gone"
  cmp mine.toml /etc/posed/posed.toml || fail "the removal changed the configuration"
  dpkg --purge posed-tools posed | tee purged
  grep -q '/var/lib/posed' purged || fail "the purge does not say that maps are kept"
  [ -s /var/lib/posed/map ] || fail "the purge took the map"
  cmp mine.toml /etc/posed/posed.toml || fail "the purge took the configuration"
  [ ! -e /lib/systemd/system/posed.service ] || fail "the unit is still there"
  rm -rf /etc/posed /var/lib/posed
  dpkg --install /run/posed-vm/packages/*.deb # for the cases that follow
  [ -s /etc/posed/posed.toml ] || fail "no configuration after a new installation"
}
