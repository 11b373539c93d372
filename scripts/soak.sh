#!/usr/bin/env bash
# Play the shipped bags again and again through one running graph; print what came of each loop.
# usage: scripts/soak.sh [N] [--bags FOLDER...]     default: 20 loops of bags/
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=scripts/environment.sh
source "$here/environment.sh"
case ${1:-} in
  -h | --help) help_of "$0" && exit ;;
esac
loops=${1:-20}
[ $# -eq 0 ] || shift
"$here/setup.sh"
enter_venv
enter_overlay
cd "$root"
[ $# -gt 0 ] || set -- --bags bags
exec python -m intent_imitation.workshop.trials.realtime --loops "$loops" "$@"
