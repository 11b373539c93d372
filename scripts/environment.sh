# Sourced by the other scripts: the environment of the workspace (ROS, virtual environment, overlay).
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=$root/.venv

fail() {
  echo "error: $*" >&2
  exit 1
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
