#!/usr/bin/env bash
# Replay a recorded demonstration through the five nodes: posterior, robot grasp, and a report.
# usage: scripts/demo.sh [BAG] [--out DIR] [--robot-bag BAG] [--models DB] [--params FILE]
#          [--model BN^H] [--network BN^R] [--library FILE] [--topics COLOR DEPTH INFO] [--depth-scale M]
#   BAG            a rosbag2 folder with colour, depth and camera_info; default: a shipped one
#   --out DIR      where result.json, pictures and report.html go; default: out/demo. Only files of
#                  earlier runs are replaced
#   --robot-bag    the robot's own table; default: bags/robot_table
#   --models DB    objects of your own (YAML file or folder), added to the shipped 48; see docs/own_object.md
#   --params FILE  parameters of the nodes (see src/*/config)
#   --model FILE   what the person's grasps mean: networks of `train`; default: the shipped BN^H
#   --network FILE what the robot's grasps are good for; default: the shipped BN^R
#   --library FILE grasps of a robot hand of your own (docs/own_hand.md); default: the Schunk hand's
#   --topics C D I the bag's topics of colour, depth and camera_info; default: they are found
#   --depth-scale  length of one unit of depth in metres; default: integers are millimetres
# A run that does not see the whole bag ends with an error that says after how many frames.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source=scripts/environment.sh
source "$here/environment.sh"
# shellcheck source=scripts/graph.sh
source "$here/graph.sh"
bag='' out=$root/out/demo robot=$root/bags/robot_table models='' params='' model='' network='' library='' given=()
while [ $# -gt 0 ]; do
  case $1 in
    --out | --robot-bag | --models | --params | --model | --network | --library) [ $# -gt 1 ] || fail "$1 needs a value" ;;&
    --out) out=$(realpath -m "$2") && shift 2 ;;
    --robot-bag) robot=$(realpath -m "$2") && shift 2 ;;
    --models) models=$(realpath -m "$2") && shift 2 ;;
    --params) params=$(realpath -m "$2") && shift 2 ;;
    --model) model=$(realpath -m "$2") && shift 2 ;;
    --network) network=$(realpath -m "$2") && shift 2 ;;
    --library) library=$(realpath -m "$2") && shift 2 ;;
    --topics)
      [ $# -gt 3 ] || fail "--topics needs COLOR DEPTH INFO"
      given+=("${@:1:4}") && shift 4
      ;;
    --depth-scale)
      [ $# -gt 1 ] || fail "$1 needs a value"
      given+=("$1" "$2") && shift 2
      ;;
    -h | --help) help_of "$0" && exit ;;
    -*) fail "unknown option $1; see scripts/demo.sh --help" ;;
    *) bag=$(realpath -m "$1") && shift ;;
  esac
done
bag=${bag:-$root/bags/pour_bottle}
"$here/setup.sh"
enter_venv
enter_overlay
private_domain
export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1} OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1}

heard=$(python -m intent_perception.replay "$bag" "${given[@]}") # fails here, with one sentence, on a damaged bag
robot_heard=$(python -m intent_perception.replay "$robot")
python -m intent_imitation.demo.result_files "$out" # here, where somebody else's files stand in the way
common=(--ros-args --log-level warn --params-file "$root/src/intent_imitation/config/lockstep.yaml")
[ -z "$models" ] || common+=(-p "models:=$models")
for file in ${params:+"$params"} ${model:+"$model"} ${network:+"$network"} ${library:+"$library"}; do
  [ -r "$file" ] || fail "cannot read $file"
done
[ -z "$params" ] || common+=(--params-file "$params")
stop_at_exit
# shellcheck disable=SC2086
{
  start intent_perception recognizer "${common[@]}" $heard
  start intent_perception recognizer "${common[@]}" $robot_heard -r __ns:=/robot
  start intent_tracking tracker "${common[@]}" $heard
}
start intent_tracking grasp_detector "${common[@]}"
start intent_inference inference "${common[@]}" ${model:+-p "model:=$model"}
start intent_imitation imitation "${common[@]}" -r imitation/robot_objects:=/robot/intent/objects \
  -r imitation/robot_shapes:=/robot/intent/shapes \
  ${network:+-p "network:=$network"} ${library:+-p "library:=$library"}
nodes=("${pids[@]}")
start intent_imitation demo "$bag" --robot-bag "$robot" ${models:+--models "$models"} ${library:+--library "$library"} \
  "${given[@]}" --out "$out"
demo=${pids[-1]}
start intent_perception replay "$robot" --lockstep --objects-only --wait 480 --timeout 480 \
  --ros-args --log-level warn -r __ns:=/robot
finish "${pids[-1]}" "${nodes[@]}" || fail "the robot's table was not recognised; see the messages above"
[ "${given[0]:-}" = --topics ] && chosen=("${given[@]:0:4}") || chosen=()
start intent_perception replay "$bag" "${chosen[@]}" --lockstep --subscribers 2 --listeners 4 --wait 480 --timeout 480 \
  --ros-args --log-level warn
finish "${pids[-1]}" "${nodes[@]}" || fail "the bag was not played to its end, nothing is concluded; see the messages above"
finish "$demo" "${nodes[@]}" || fail "the run gave no result; see the messages above"
echo "report          $out/report.html"
