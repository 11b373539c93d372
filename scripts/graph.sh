# Sourced after environment.sh: start nodes by `ros2 run` and stop all of them together.
pids=() names=() commands=() respawn=''

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
  pids+=($!) names+=("$2") commands+=("$(printf '%q ' "$@")")
  set +m
}

# has_ended INDEX: whether a process has; then it is said which, and how, in `epitaph`.
has_ended() {
  local status=0
  kill -0 "${pids[$1]}" 2>/dev/null && return 1
  wait "${pids[$1]}" 2>/dev/null || status=$?
  epitaph="the node ${names[$1]} has ended (status $status)"
  [ $status -le 128 ] || epitaph="the node ${names[$1]} has ended (killed by SIG$(kill -l $((status - 128))))"
}

# start_again INDEX: run a process anew in its place.
start_again() {
  echo "$epitaph; it is started again" >&2
  eval "start ${commands[$1]}"
  pids[$1]=${pids[-1]}
  unset 'pids[-1]' 'names[-1]' 'commands[-1]'
}

# nap: a moment in which the shell keeps its own word for a dead job ("Killed") to itself.
nap() { { sleep 0.2; } 2>/dev/null; }

# watch: say which node ends, and start it again where respawn is set, until none is left.
watch() {
  local i told=()
  while [ ${#told[@]} -lt ${#pids[@]} ]; do
    for i in "${!pids[@]}"; do
      [ -z "${told[$i]:-}" ] && has_ended "$i" || continue
      if [ -n "$respawn" ]; then
        for _ in 1 2 3 4 5; do nap; done # a node that cannot start must not fill the screen
        start_again "$i"
      else
        told[i]=yes
        echo "error: $epitaph; the others go on (--respawn would start it again)" >&2
      fi
    done
    nap
  done
  fail "no node is left"
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
  local pid=$1 nodes=" ${*:2} " i
  while kill -0 "$pid" 2>/dev/null; do
    for i in "${!pids[@]}"; do
      [[ $nodes == *" ${pids[$i]} "* ]] && has_ended "$i" || continue
      [ -n "$respawn" ] || fail "$epitaph; see its message above"
      start_again "$i" && nodes+="${pids[$i]} "
    done
    nap
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
