#!/usr/bin/env bash
# Make the environment and build the workspace; a second run finds its stamps and does nothing.
# usage: scripts/setup.sh [--dev]
#   --dev          also what the tests, the checks, the simulation and the making of bags and
#                  objects need: about 0.5 GB more, and five minutes to build pybullet
# The demo and the nodes need no --dev. After an update (git pull) the same command does what is new;
# scripts/clean.sh removes all of it.
set -euo pipefail
# shellcheck source=scripts/environment.sh
source "$(dirname "${BASH_SOURCE[0]}")/environment.sh"
case ${1:-} in
  -h | --help) help_of "$0" && exit ;;
  '' | --dev) ;;
  *) fail "unknown option $1; see scripts/setup.sh --help" ;;
esac
[[ $root != *[[:space:]]* ]] || fail "the workspace's path has a blank, which colcon's scripts do not bear: move it from '$root'"
[ -w "$root" ] || fail "you may not write into $root; clone the workspace into a folder of your own"
cd "$root"
stamps=$venv/stamps

# once NAME INPUT... -- COMMAND...: run COMMAND unless it succeeded before with the same inputs.
once() {
  local name=$1 inputs=() sum
  shift
  while [ "$1" != -- ]; do inputs+=("$1") && shift; done
  shift
  sum=$(find "${inputs[@]}" -type f -not -path '*/__pycache__/*' -print0 | sort -z | xargs -0 sha256sum | sha256sum)
  sum="$sum $root"
  [ "$(cat "$stamps/$name" 2>/dev/null)" = "$sum" ] && return
  local began=$SECONDS clock=''
  echo "setup: $name" >&2
  if [ -t 2 ]; then # a clock, so that minutes of silence are none
    (while sleep 1; do printf '\rsetup: %s, %d s ' "$name" $((SECONDS - began)) >&2; done) &
    clock=$!
    trap 'kill $clock 2>/dev/null' EXIT
  fi
  "$@"
  if [ -n "$clock" ]; then
    kill "$clock" 2>/dev/null || true
    trap - EXIT
    printf '\r' >&2
  fi
  echo "setup: $name done after $((SECONDS - began)) s" >&2
  mkdir -p "$stamps" && echo "$sum" >"$stamps/$name"
}

install() {
  local file arguments=()
  for file in "$@"; do arguments+=(-r "$file"); done
  python -m pip install --quiet --no-warn-script-location "${arguments[@]}" >"$venv/pip.log" 2>&1 ||
    { tail -20 "$venv/pip.log" >&2 && fail "pip could not install $*; see above (is the package index reachable?)"; }
}

install_dev() {
  install requirements-dev.txt
  python -c 'import open3d' 2>/dev/null ||
    ln -sf "$venv"/lib/python3.12/site-packages/libusb_package/libusb-1.0.so "$venv/lib/libusb-1.0.so.0"
}

install_run() {
  local ros=requirements-ros.txt
  if system_ros; then # its messages and nodes, but built by the virtual environment's colcon and Python
    ros=$venv/requirements-colcon.txt
    grep -v '^ros-' requirements-ros.txt >"$ros"
  fi
  install requirements.txt "$ros"
  command -v cmake >/dev/null || python -m pip install --quiet cmake
  system_ros || repair_cmake "$venv"
}

build() {
  command -v c++ >/dev/null || fail "no C++ compiler was found; install g++ (the messages need it)"
  local missing=()
  python -c 'import ament_index_python as a; a.get_package_prefix("tf2_msgs")' 2>/dev/null ||
    missing=(--paths msg_defs/stand_ins/tf2_msgs)
  python -m colcon build --base-paths msg_defs src "${missing[@]}" --symlink-install --metas colcon.meta --event-handlers \
    console_direct- console_cohesion- summary+ >"$venv/colcon.log" 2>&1 ||
    { tail -40 "$venv/colcon.log" >&2 && fail "colcon build failed; the whole log is in $venv/colcon.log"; }
}

# Without them the tracker finds hands by depth and skin colour alone, so it may come later.
fetch_networks() {
  PYTHONPATH=$root/src/intent_perception:$root/src/intent_tracking${PYTHONPATH:+:$PYTHONPATH} \
    python -m intent_tracking.fetch_hand_networks >"$venv/networks.log" 2>&1 && return
  tail -1 "$venv/networks.log" >&2
  echo "setup: no hand networks; later: scripts/env.sh python -m intent_tracking.fetch_hand_networks" >&2
  exit 1 # of the subshell: no stamp, so the next set-up tries again
}

# A compiled function in numba's cache does not notice that one which it calls has changed.
forget_kernels() {
  find src -path '*/__pycache__/*.nb?' -delete
}

# Every node goes once through a rehearsal, two at a time, which compiles what it needs.
compile_kernels() {
  forget_kernels
  export ROS_AUTOMATIC_DISCOVERY_RANGE=OFF OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
  enter_overlay
  compile_one() {
    "$root/install/$1/lib/$1/$2" --rehearse >"$venv/kernels-$2.log" 2>&1 || { tail -3 "$venv/kernels-$2.log" >&2 && return 1; }
    echo "setup: kernels of $2 compiled after ${SECONDS} s"
  }
  (compile_one intent_perception recognizer && compile_one intent_imitation imitation) &
  compile_one intent_tracking tracker
  compile_one intent_tracking grasp_detector
  compile_one intent_inference inference
  wait $! || fail "kernels could not be compiled; see $venv/kernels-*.log"
}

exec 9>"$root/.setup.lock"
flock 9 # two scripts started together set up once
if [ ! -x "$venv/bin/python" ]; then
  python=$(find_python)
  "$python" -m venv "$venv" || fail "$python could not make a virtual environment in $venv"
fi
enter_venv
once install requirements.txt requirements-ros.txt -- install_run
enter_venv # the libraries' folders exist only now
[ "${1:-}" != --dev ] || once install-dev requirements-dev.txt -- install_dev
once build msg_defs colcon.meta src/*/package.xml src/*/setup.* src/*/config src/*/launch src/*/rviz \
  -- build
(once hand-networks src/intent_tracking/intent_tracking/hands/networks/network_files.py -- fetch_networks) || true
mapfile -t kernels < <(grep -rlE --include='*.py' '^@(\w+_)?kernel$' src)
once kernels src/intent_perception/intent_perception/basics/kernels.py "${kernels[@]}" -- compile_kernels
