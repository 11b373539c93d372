#!/usr/bin/env bash
# The ros2 commands that a user of the graph needs; the installation's own `ros2` where there is one.
# usage: scripts/ros2.sh run PACKAGE EXECUTABLE [ARG...]
#        scripts/ros2.sh topic list [-t] | topic echo TOPIC [--once] | topic hz TOPIC
#        scripts/ros2.sh node list
#        scripts/ros2.sh param list NODE | param get NODE NAME | param set NODE NAME VALUE
#        scripts/ros2.sh param describe NODE NAME
#        scripts/ros2.sh bag record [-o FOLDER] [TOPIC...]     Ctrl-C ends it; default: all topics
#        scripts/ros2.sh interface show TYPE     e.g. intent_msgs/msg/TaskPosterior
# ROS_DOMAIN_ID chooses whom it hears, as with ros2 (scripts/demo.sh plays in a domain of its own).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=scripts/environment.sh
source "$here/environment.sh"
# shellcheck source=scripts/graph.sh
source "$here/graph.sh"
case ${1:-} in
  -h | --help) help_of "$0" && exit ;;
  '') help_of "$0" >&2 && exit 2 ;;
esac
"$here/setup.sh"
enter_venv
enter_overlay
command -v ros2 >/dev/null && exec ros2 "$@"
if [ "$1" = run ]; then
  [ $# -ge 3 ] || fail "usage: scripts/ros2.sh run PACKAGE EXECUTABLE [ARG...]"
  ros2_run "${@:2}"
fi
exec python -P -c 'import sys
from intent_perception.basics.commands import command
sys.argv[0] = "ros2.sh"
command("intent_perception.ros.stand_in.ros2_command")' "$@"
