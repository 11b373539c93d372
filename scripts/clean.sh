#!/usr/bin/env bash
# Remove what set-up and runs left in this workspace, and say how much space that freed.
# usage: scripts/clean.sh [--dry-run]
#   --dry-run      only say what would go
# Removed: .venv, build, install, log, caches, files that the demo wrote to out/demo, bags that
# bags/make.py made anew, shared memory of this user's ROS programs that have ended without removing
# it. Everything else stays: your own files, other folders in out/, changes to the sources.
# It asks nothing; scripts/demo.sh sets everything up again.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=scripts/environment.sh
source "$here/environment.sh"
dry='' freed=0
case ${1:-} in
  -h | --help) help_of "$0" && exit ;;
  --dry-run) dry=yes ;;
  '') ;;
  *) fail "unknown option $1; see scripts/clean.sh --help" ;;
esac
shared=${INTENT_SHARED_MEMORY:-/dev/shm}

# drop PATH...: remove what is there, and count it.
drop() {
  local path size
  for path in "$@"; do
    [ -e "$path" ] || [ -L "$path" ] || continue
    size=$(du -sk "$path" | cut -f1)
    freed=$((freed + size))
    echo "$path ($((size / 1024)) MB)"
    [ -n "$dry" ] || rm -rf -- "$path"
  done
}

# Folders of colcon say so themselves.
drop_built() {
  local name
  for name in build install log; do
    [ ! -e "$root/$name/COLCON_IGNORE" ] || drop "$root/$name"
  done
}

# drop_own FOLDER: what runs wrote into it (.own_files.json: name and SHA-256) and nobody has changed.
drop_own() {
  local list=$1/.own_files.json content name
  [ -f "$list" ] || return 0
  while read -r content name; do
    [ "$(sha256sum 2>/dev/null <"$1/$name" | cut -d' ' -f1)" != "$content" ] || drop "$1/$name"
  done < <(sed -nE 's/^ "(.*)": "([0-9a-f]{64})",?$/\2 \1/p' "$list" 2>/dev/null)
  drop "$list"
  [ -n "$dry" ] || find "$1" -depth -type d -empty -delete
}

# drop_orphaned FOLDER PATTERN: files of programs that were killed.
drop_orphaned() {
  local files
  mapfile -t files < <(python3 "$root/src/intent_perception/intent_perception/basics/orphaned_files.py" "$@")
  drop "${files[@]}"
}

[ ! -f "$venv/pyvenv.cfg" ] || drop "$venv"
drop_built
mapfile -t caches < <(find "$root"/{src,tests,bags,scripts} -name __pycache__ -prune 2>/dev/null)
drop "${caches[@]}" "$root"/src/*/*.egg-info "$root"/.{mypy,ruff,pytest,import_linter}_cache "$root/.setup.lock"
for folder in "$root/out/demo" "$root"/bags/generated/*; do drop_own "$folder"; done
drop_orphaned "$shared" '*fastrtps_*'
drop_orphaned "${TMPDIR:-/tmp}" "intent_domain_${UID}_*"
echo "${dry:+would be }freed: $((freed / 1024)) MB"
