#!/usr/bin/env bash
# Run the five nodes for a live camera until Ctrl-C, or for a bag until it has been played.
# usage: scripts/run_graph.sh [--bag BAG [--rate R] [--lockstep]] [--models DB] [--params FILE]
#          [--topics COLOR DEPTH INFO] [--depth-scale M] [--respawn] [--view [PORT]]
#          [ROS argument...]
#   --bag BAG      play this bag once the nodes are ready; without it they wait for a camera
#   --rate R       play it at this speed, 1 = as recorded
#   --lockstep     play it frame by frame, each once the one before has been answered
#   --respawn      start a node again that has ended; otherwise that is only said, by its name
#   --view [PORT]  also run the viewer: what the system believes, drawn into the camera's picture, on
#                  /intent/image/compressed and on http://127.0.0.1:PORT (8765), here alone
#   --models DB    objects of your own (YAML file or folder), added to the shipped 48; see docs/own_object.md
#   --params FILE  parameters of the nodes (see src/*/config)
#   --topics C D I the bag's topics of colour, depth and camera_info; default: they are found
#   --depth-scale  length of one unit of depth in metres; default: integers are millimetres
#   others         handed to every node, e.g. -r rgb/camera_info:=/camera/color/camera_info
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=scripts/environment.sh
source "$here/environment.sh"
# shellcheck source=scripts/graph.sh
source "$here/graph.sh"
bag='' arguments=() player=() given=() view=''
while [ $# -gt 0 ]; do
  case $1 in
    --bag | --rate | --models | --params) [ $# -gt 1 ] || fail "$1 needs a value" ;;&
    --bag) bag=$(realpath "$2") && shift 2 ;;
    --rate) player+=(--rate "$2") && shift 2 ;;
    --lockstep)
      player+=(--lockstep --timeout 480)
      arguments+=(--params-file "$root/src/intent_imitation/config/lockstep.yaml") && shift
      ;;
    --respawn) respawn=yes && shift ;;
    --view)
      view=8765 && shift
      [[ ! ${1:-} =~ ^[0-9]+$ ]] || { view=$1 && shift; }
      ;;
    --models) arguments+=(-p "models:=$(realpath "$2")") && shift 2 ;;
    --params) arguments+=(--params-file "$(realpath "$2")") && shift 2 ;;
    --topics)
      [ $# -gt 3 ] || fail "--topics needs COLOR DEPTH INFO"
      given+=("${@:1:4}") && player+=("${@:1:4}") && shift 4
      ;;
    --depth-scale)
      [ $# -gt 1 ] || fail "$1 needs a value"
      given+=("$1" "$2") && arguments+=(-p "depth_scale:=$2") && shift 2
      ;;
    -h | --help) help_of "$0" && exit ;;
    *) arguments+=("$1") && shift ;;
  esac
done
"$here/setup.sh"
enter_venv
enter_overlay
if [ -n "$bag" ]; then
  read -r -a transports < <(python -m intent_perception.replay "$bag" "${given[@]}") || fail "cannot play $bag"
  arguments+=("${transports[@]}")
fi
stop_at_exit
start intent_perception recognizer --ros-args "${arguments[@]}"
start intent_tracking tracker --ros-args "${arguments[@]}"
start intent_tracking grasp_detector --ros-args "${arguments[@]}"
start intent_inference inference --ros-args "${arguments[@]}"
start intent_imitation imitation --ros-args -r imitation/robot_objects:=intent/objects \
  -r imitation/robot_shapes:=intent/shapes "${arguments[@]}"
if [ -n "$view" ]; then
  start intent_imitation viewer --ros-args "${arguments[@]}" -p "port:=$view"
  echo "http://127.0.0.1:$view shows what the system believes"
fi
if [ -n "$bag" ]; then
  nodes=("${pids[@]}")
  start intent_perception replay "$bag" --subscribers 2 --wait 120 "${player[@]}" \
    --await recognizer tracker grasp_detector inference imitation
  finish "${pids[-1]}" "${nodes[@]}" || fail "the bag was not played to its end; see the messages above"
  exit
fi
watch
