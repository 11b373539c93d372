#!/usr/bin/env bash
# Try the workspace where ROS is installed: its wheels are laid out as /opt/ros/jazzy in a throw-away
# folder, a clone of this repository is set up beside it, and a shipped bag is answered.
# usage: tests/support/installed_ros.sh [--colcon]
#   --colcon       not by the scripts but as a plain colcon workspace, with the versions of numpy, SciPy,
#                  numba, OpenCV and scikit-learn that Ubuntu 24.04 has: build, core tests, nodes get ready
# It needs the package index and about ten minutes.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=scripts/environment.sh
source "$here/scripts/environment.sh"
case ${1:-} in
  -h | --help) help_of "$0" && exit ;;
  '' | --colcon) ;;
  *) fail "unknown option $1; see tests/support/installed_ros.sh --help" ;;
esac
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
prefix=$folder/opt/ros/jazzy site=$folder/opt/ros/jazzy/lib/python3.12/site-packages
ubuntu=('numpy==1.26.4' 'scipy==1.11.4' 'numba==0.59.1' 'opencv-python-headless==4.6.0.66' 'matplotlib<3.9'
  'scikit-learn==1.4.1.post1' 'pandas<2.3' pyyaml joblib networkx trimesh rosbags colcon-common-extensions
  'setuptools<80' pytest manifold3d)

# lay_out [PIP ARGUMENT...]: the installation, with what else its Python has.
lay_out() {
  mkdir -p "$folder/opt/ros"
  "$(find_python)" -m venv "$prefix"
  "$prefix/bin/python" -m pip install --quiet -r <(grep '^ros-' "$here/requirements-ros.txt") "$@"
  repair_cmake "$prefix"
}

# as_sourced COMMAND...: run it in the environment of a shell that has sourced the installation.
as_sourced() {
  env -u VIRTUAL_ENV -u COLCON_PREFIX_PATH ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3 \
    AMENT_PREFIX_PATH="$prefix" CMAKE_PREFIX_PATH="$prefix" PYTHONPATH="$site" \
    LD_LIBRARY_PATH="$(printf '%s:' "$site"/ros_*.libs)$prefix/lib" _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 "$@"
}

by_scripts() {
  lay_out
  git clone --quiet "$here" "$folder/clone"
  as_sourced "$folder/clone/scripts/setup.sh"
  [ -z "$("$folder/clone/.venv/bin/python" -P -m pip list 2>/dev/null | grep '^ros-')" ] ||
    fail "wheels of ROS were installed although ROS is there"
  as_sourced "$folder/clone/scripts/demo.sh"
}

by_colcon() {
  local stand_in=src/intent/msg_defs/stand_ins/tf2_msgs PATH=$prefix/bin:$PATH
  lay_out "${ubuntu[@]}" -r "$here/requirements-rosdep.txt"
  mkdir -p "$folder/workspace/src"
  git clone --quiet "$here" "$folder/workspace/src/intent"
  cd "$folder/workspace"
  as_sourced colcon build --symlink-install
  as_sourced colcon build --base-paths $stand_in --paths $stand_in # the wheels bring none
  # Beside pgmpy, which wants numpy 2, pybullet, and what is timed with compiled kernels.
  as_sourced bash -c 'source install/setup.bash && cd src/intent && exec python -m pytest "$@"' - -q tests \
    -m 'not slow and not ros and not bags' -k 'not pgmpy and not every_recipe' --ignore tests/ros --ignore tests/replay --ignore tests/house \
    --ignore tests/intent_inference/motion/test_motion_against_pgmpy.py --ignore tests/faults/test_bounds.py \
    --ignore tests/intent_inference/workshop/test_stability.py
  local node
  for node in intent_perception/recognizer intent_tracking/{tracker,grasp_detector} intent_inference/inference \
    intent_imitation/imitation; do
    as_sourced bash -c "source install/setup.bash && install/${node%/*}/lib/$node --rehearse"
    echo "$node is ready"
  done
}

if [ "${1:-}" = --colcon ]; then by_colcon; else by_scripts; fi
