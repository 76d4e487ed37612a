# shellcheck shell=bash disable=SC2154  # variables of lib.sh
# posed and posectl on this system, without devices.

# posed and posectl start with the libraries that the packages bring.
case_programs_start() {
  posed --version
  posectl version
  posed --check-config --config /usr/share/posed/posed.toml
}
