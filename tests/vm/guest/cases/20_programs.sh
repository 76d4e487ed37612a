# shellcheck shell=bash disable=SC2154  # variables of lib.sh
# posed and posectl on this system, and posed as a service.

# posed and posectl start with the libraries that the packages bring.
case_programs_start() {
  posed --version
  posectl version
  posed --check-config --config /usr/share/posed/posed.toml
}

# run_service PROPERTY...: posed with case.toml as systemd's service `posed`; returns when systemd takes it for started, and sets `run`.
run_service() {
  plug_cameras
  chmod 755 /run/case
  chmod 644 ./*.toml
  systemd-run --quiet --unit=posed-case --service-type=notify --property="TimeoutStartSec=$patience_s" "$@" \
    /usr/bin/posed --config /run/case/case.toml || return # also where the caller has switched off `set -e`
  run=$(show_service InvocationID)
}

show_service() { systemctl show posed-case --property="$1" --value; }

# show_journal: what this run of it has logged, to the case's log and to the file `journal`.
show_journal() { journalctl --output=cat --no-pager "_SYSTEMD_INVOCATION_ID=$run" | tee journal; }

# As a service of Type=notify posed becomes ready, says what it does, publishes poses, and ends on request without an error.
case_service_becomes_ready() {
  write_v4l2_config yuyv <<<"$squares"
  run_service || fail "systemd does not see it become ready"
  [ "$(show_service ActiveState)" = active ] || fail "it is $(show_service ActiveState)"
  [ -n "$(show_service StatusText)" ] || fail "it says nothing of its status"
  expect_poses 5
  systemctl stop posed-case
  show_journal
  grep -q 'stopping: SIGTERM' journal || fail "it was not asked to end"
  ! systemctl is-failed --quiet posed-case || fail "its end is taken for a failure"
}

# A configuration that cannot be used ends the service with status 78 (EX_CONFIG) before it is ready.
case_service_refuses_configuration() {
  { echo 'no_such_key = 1'; echo '[source]'; } | write_config
  ! run_service --property=RemainAfterExit=no 2>/dev/null || fail "it became ready"
  [ "$(show_service ExecMainStatus)" = 78 ] || fail "its exit status is $(show_service ExecMainStatus)"
}

# policy_of_thread NAME: the scheduling policy of a thread of posed, as `ps` calls it.
policy_of_thread() { ps -L -o comm=,cls= -p "$(show_service MainPID)" | awk -v name="$1" '$1 == name { print $2 }'; }

# As a user of its own with the right to it, posed runs its capture thread under SCHED_FIFO.
case_service_real_time() {
  write_v4l2_config yuyv <<<"$squares"$'\n[pipeline.capture]\npolicy = "fifo"\npriority = 20'
  run_service --property=DynamicUser=yes --property=SupplementaryGroups=video --property=LimitRTPRIO=40
  show_journal
  [ "$(policy_of_thread capture)" = FF ] || fail "the capture thread has the policy '$(policy_of_thread capture)'"
}

# Without that right posed warns and runs on.
case_service_real_time_refused() {
  write_v4l2_config yuyv <<<"$squares"$'\n[pipeline.capture]\npolicy = "fifo"\npriority = 20'
  run_service --property=DynamicUser=yes --property=SupplementaryGroups=video --property=LimitRTPRIO=0
  expect_poses 3
  show_journal
  [ "$(policy_of_thread capture)" = TS ] || fail "the capture thread has the policy '$(policy_of_thread capture)'"
  grep -q 'SCHED_FIFO priority 20' journal || fail "no warning"
}
