# Sourced by the other scripts: the environment of the workspace (ROS, virtual environment, overlay).
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=$root/.venv

fail() {
  echo "error: $*" >&2
  exit 1
}

# find_python: the first Python 3.12 that can make virtual environments.
find_python() {
  local candidate
  for candidate in python3.12 python3 "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.12*/bin/python3; do
    # A pyenv shim may exist and fail: only an interpreter that answers counts.
    if "$candidate" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info[:2] != (3, 12))' 2>/dev/null; then
      echo "$candidate"
      return
    fi
  done
  fail "Python 3.12 with its venv module was not found; install python3.12 and python3.12-venv"
}

# repair_cmake PREFIX: the wheels' CMake files name the folders of the machine that built them.
repair_cmake() {
  local include numpy
  include=$("$1/bin/python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
  numpy=$("$1/bin/python" -c 'import numpy; print(numpy.get_include())')
  # A second set-up finds none left.
  { grep -rlZ '/opt/python/cp312-cp312' "$1/share" --include='*.cmake' || true; } | xargs -0 -r sed -i \
    -e "s|/opt/python/cp312-cp312/lib/python3.12/site-packages/numpy/_core/include|$numpy|g" \
    -e "s|/opt/python/cp312-cp312/include/python3.12|$include|g"
}

# help_of SCRIPT: the comment at a script's head is its help.
help_of() { awk 'NR > 1 { if (!/^#/) exit; sub(/^# ?/, ""); print }' "$1"; }

# ROS comes from a sourced installation, else from wheels in the virtual environment.
system_ros() { [ "${ROS_DISTRO:-}" = jazzy ] && [[ "${AMENT_PREFIX_PATH:-}" == */opt/ros/jazzy* ]]; }

enter_venv() {
  export VIRTUAL_ENV=$venv PATH=$venv/bin:$PATH PYTHONNOUSERSITE=1
  unset PYTHONHOME
  export LD_LIBRARY_PATH=$venv/lib:${LD_LIBRARY_PATH:-}
  system_ros && return
  local site libs
  site=$(echo "$venv"/lib/python3.12/site-packages)
  libs=$(printf '%s:' "$site"/ros_*.libs)
  # Activation does not set these; with them the wheels' start-up hook has nothing left to re-execute.
  export AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv
  export LD_LIBRARY_PATH=$libs$LD_LIBRARY_PATH
  export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
}

enter_overlay() {
  [ -f "$root/install/local_setup.bash" ] || fail "the workspace is not built; run scripts/setup.sh"
  set +u
  # shellcheck disable=SC1091
  source "$root/install/local_setup.bash"
  set -u
  # Images outgrow Fast DDS's default segment, so best-effort frames would be lost.
  local profile=$root/src/intent_imitation/config/fastdds.xml
  export FASTRTPS_DEFAULT_PROFILES_FILE=${FASTRTPS_DEFAULT_PROFILES_FILE:-$profile}
  export RMW_IMPLEMENTATION=${RMW_IMPLEMENTATION:-rmw_fastrtps_cpp}
}
