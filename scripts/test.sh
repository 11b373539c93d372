#!/usr/bin/env bash
# Check everything: format, lint, types, import rules, tests.
# usage: scripts/test.sh [pytest argument...]    with arguments: only pytest, with them
# e.g.   scripts/test.sh tests/intent_tracking -m "not slow"
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=scripts/environment.sh
source "$here/environment.sh"
case ${1:-} in
  -h | --help) help_of "$0" && exit ;;
esac
"$here/setup.sh" --dev
enter_venv
enter_overlay
cd "$root"
if [ $# -eq 0 ]; then
  ruff format --check --quiet . || fail "ruff would format files differently; run scripts/env.sh ruff format"
  ruff check --quiet .
  mypy
  PYTHONPATH=$(printf '%s:' src/*)$PYTHONPATH lint-imports --no-logo 2>/dev/null ||
    PYTHONPATH=$(printf '%s:' src/*)$PYTHONPATH lint-imports
fi
exec python -m pytest "$@"
