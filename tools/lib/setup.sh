# shellcheck shell=bash
# Helpers of tools/demo and tools/test: messages, named steps with logs, packages. Source it from the repository's root, after
# `set -euo pipefail`. It installs an EXIT trap that ends what start_child started.

# shellcheck source=tools/lib/packages.sh
source tools/lib/packages.sh

readonly posed_logs=build/logs
mkdir -p "$posed_logs"
posed_children=() # process ids to end on exit

say() { printf '==> %s\n' "$*"; }

# fail MESSAGE...: one line each, the first naming what failed, the others how to go on.
fail() {
  printf 'error: %s\n' "$1" >&2
  shift
  [ $# -eq 0 ] || printf '       %s\n' "$@" >&2
  exit 1
}

# start_child COMMAND...: runs it in the background; `child` is its process id. It ends with this script, if not before by end_child.
start_child() {
  "$@" &
  child=$!
  posed_children+=("$child")
}

# end_child PID: asks the process to end and waits for it. Its exit status is lost.
end_child() {
  kill "$1" 2>/dev/null || true
  wait "$1" 2>/dev/null || true
  local pid remaining=()
  for pid in "${posed_children[@]}"; do
    [ "$pid" = "$1" ] || remaining+=("$pid")
  done
  posed_children=("${remaining[@]}")
}

end_all_children() {
  local pid
  for pid in "${posed_children[@]}"; do
    end_child "$pid"
  done
}
trap end_all_children EXIT

# show_progress LOG [SECONDS]: repeats the log's last line from time to time, for steps that take long.
show_progress() {
  local nap=
  trap 'kill "$nap" 2>/dev/null; exit 0' TERM
  while :; do
    sleep "${2:-20}" >/dev/null 2>&1 &
    nap=$!
    wait "$nap"
    printf '    ... %s\n' "$(tail -n 1 "$1" | cut -c 1-130)"
  done
}

# run_step NAME LOG HINT COMMAND...: runs the command with its output in build/logs/LOG. Where it fails, shows the end of the log, names
# the step and the hint, and exits.
run_step() {
  local name=$1 log=$posed_logs/$2 hint=$3 started=$SECONDS status=0 progress
  shift 3
  say "$name"
  : >"$log"
  start_child show_progress "$log"
  progress=$child
  "$@" >"$log" 2>&1 </dev/null || status=$?
  end_child "$progress"
  if [ "$status" -ne 0 ]; then
    tail -n 25 "$log" | sed 's/^/    /' >&2
    fail "step '$name' failed (exit status $status)" "Full output: $log" "$hint"
  fi
  printf '    done in %d s\n' $((SECONDS - started))
}

is_installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

# find_root: sets the array `root` to what must stand before a command that needs root's rights; fails where there is no way.
find_root() {
  if [ "$(id -u)" -eq 0 ]; then
    root=()
  elif ! command -v sudo >/dev/null; then
    return 1
  elif sudo -n true 2>/dev/null; then
    root=(sudo -n)
  elif [ -t 0 ] && [ -t 2 ]; then
    root=(sudo) # asks for the password
    sudo -v
  else
    return 1
  fi
}

# need_packages ENTRY...: installs those of the packages ("package|purpose") that are missing.
need_packages() {
  command -v dpkg-query >/dev/null ||
    fail "this script installs Debian packages, and this system has no dpkg" "Install what docs/dependencies.md lists, then build with: cmake --preset release"
  local entry missing=() root=()
  for entry in "$@"; do
    is_installed "${entry%%|*}" || missing+=("$entry")
  done
  if [ ${#missing[@]} -eq 0 ]; then
    say "Packages: all $# are installed"
    return
  fi
  say "Packages: $(($# - ${#missing[@]})) of $# are installed, missing are:"
  printf '%s\n' "${missing[@]}" | sed 's/|/\t/' | awk -F '\t' '{ printf "      %-26s %s\n", $1, $2 }'
  local names=("${missing[@]%%|*}")
  find_root || fail "installing packages needs root's rights: run as root, or as a user with sudo" \
    "Or ask an administrator for: apt-get install --no-install-recommends ${names[*]}"
  local apt=("${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3)
  local hint="Is the network reachable, and are Debian 12's sources in /etc/apt? Mend it and run this command again: what is done is not done twice."
  run_step "apt-get update" apt-update.log "$hint" "${apt[@]}" update
  run_step "apt-get install (${#names[@]} packages)" apt-install.log "$hint" "${apt[@]}" install --no-install-recommends "${names[@]}"
}

# build_jobs: how many compilers to run at a time: one a core, but no more than memory allows.
build_jobs() {
  local cores memory_kib jobs
  local -r kib_per_compiler=1500000
  cores=$(nproc)
  memory_kib=$(awk '/^MemAvailable:/ { print $2 }' /proc/meminfo)
  jobs=$((memory_kib / kib_per_compiler))
  [ "$jobs" -lt "$cores" ] || jobs=$cores
  [ "$jobs" -ge 1 ] || jobs=1
  echo "${CMAKE_BUILD_PARALLEL_LEVEL:-$jobs}"
}
