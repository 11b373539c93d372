# Sourced after environment.sh: start nodes by `ros2 run` and stop all of them together.
pids=()

# ros2_run PACKAGE EXECUTABLE ARG...: the wheels bring no `ros2`, so look up what it would run.
ros2_run() {
  if command -v ros2 >/dev/null; then
    exec ros2 run "$@"
  fi
  local package=$1 executable=$2 prefix
  shift 2
  prefix=$(ament_index packages "$package" 2>/dev/null | tail -1)
  [ -x "$prefix/lib/$package/$executable" ] || fail "no executable $executable in package $package; run scripts/setup.sh"
  exec "$prefix/lib/$package/$executable" "$@"
}

# start PACKAGE EXECUTABLE ARG...: run a node in a process group of its own.
start() {
  set -m
  (ros2_run "$@") &
  pids+=($!)
  set +m
}

# Interrupt every node, and kill within 2 s what has not ended by then.
stop_all() {
  trap - EXIT INT TERM
  local pid tries=0
  for pid in "${pids[@]}"; do kill -INT -- "-$pid" 2>/dev/null || true; done
  while [ $tries -lt 15 ] && any_alive; do sleep 0.1 && tries=$((tries + 1)); done
  for pid in "${pids[@]}"; do kill -KILL -- "-$pid" 2>/dev/null || true; done
  wait 2>/dev/null || true
}

any_alive() {
  local pid
  for pid in "${pids[@]}"; do kill -0 -- "-$pid" 2>/dev/null && return 0; done
  return 1
}

stop_at_exit() {
  trap stop_all EXIT
  trap 'exit 130' INT
  trap 'exit 143' TERM
}

# finish PID NODE_PID...: wait for a process; fail at once when it fails or one of the nodes ends.
finish() {
  local pid=$1 node
  shift
  while kill -0 "$pid" 2>/dev/null; do
    for node in "$@"; do
      kill -0 "$node" 2>/dev/null || fail "a node has ended; see its message above"
    done
    sleep 0.1
  done
  wait "$pid"
}

# Parallel runs must not hear each other: each takes a free domain until it ends.
private_domain() {
  local domain offset
  export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
  for offset in $(seq 0 99); do
    domain=$((1 + ($$ + offset) % 100))
    exec 8>"${TMPDIR:-/tmp}/intent_domain_${UID}_$domain"
    if flock -n 8; then
      export ROS_DOMAIN_ID=$domain
      return
    fi
  done
  fail "a hundred runs are active on this machine; end one of them"
}
