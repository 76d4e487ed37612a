# shellcheck shell=bash disable=SC2154  # variables of lib.sh
# Recording onto a disk that fills.

# check_recording FOLDER: it has images, and every one that its lists name can be read.
check_recording() {
  local list name
  for list in rgb depth; do
    grep -v '^#' "$1/$list.txt" | cut -d ' ' -f 2 >names || fail "$1/$list.txt names no image"
    while read -r name; do
      pngtopnm "$1/$name" >/dev/null || fail "$1/$name cannot be read"
    done <names
    echo "$1: $(wc -l <names) images in $list.txt"
  done
}

# record_onto FOLDER MIN_FREE PATTERN: until the disk ends it, which must be told by PATTERN.
record_onto() {
  ! timeout "$patience_s" posectl record --min-free "$2" --config case.toml "$1" 2>record.log || fail "a full disk is taken for success"
  grep -E -- "$3" record.log || fail "the disk is not named"
  check_recording "$1"
}

# A recording ends in order before the disk is full, and where the disk is full after all: what its lists name can be read.
case_record_disk_fills() {
  plug_cameras
  write_v4l2_config rgb24 <<<'controls = ["test_pattern=21"]' # noise, which no PNG makes smaller
  mkdir disk
  # What is captured already when too little is left is written still: some 50 MB here.
  mount -t tmpfs -o size=150M tmpfs disk
  record_onto disk/early 90MB 'MB free.*--min-free'
  record_onto disk/late 0MB 'disk/late/.*No space left'
}
