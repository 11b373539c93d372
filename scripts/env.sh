#!/usr/bin/env bash
# Run a command inside the environment: ROS, the virtual environment and the workspace overlay.
# usage: scripts/env.sh CMD...
set -euo pipefail
[ $# -gt 0 ] || { echo "usage: scripts/env.sh CMD..." >&2 && exit 2; }
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
"$here/setup.sh"
# shellcheck source=scripts/environment.sh
source "$here/environment.sh"
enter_venv
enter_overlay
exec "$@"
