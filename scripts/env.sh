#!/usr/bin/env bash
# Run a command inside the environment: ROS, the virtual environment and the workspace overlay.
# usage: scripts/env.sh CMD...    e.g. scripts/env.sh python -m intent_tracking.track --help
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=scripts/environment.sh
source "$here/environment.sh"
case ${1:-} in
  -h | --help) help_of "$0" && exit ;;
  '') help_of "$0" >&2 && exit 2 ;;
esac
"$here/setup.sh"
enter_venv
enter_overlay
exec "$@"
