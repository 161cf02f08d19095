#!/usr/bin/env bash
# The system calls of a cycle in the hot processes of a running robot, as a table in Markdown:
# `strace -c` counts them, the processes' own health counts the cycles meanwhile.
#
# Use: benches/syscalls.sh [SECONDS]      after `cargo build --release`; LEO names another program.
# Needs strace, and the right to trace one's own processes (kernel.yama.ptrace_scope at most 1, or root).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=${1:-10}
leo=${LEO:-target/release/leo}
domain=/dev/shm/leo-syscalls-$$
scratch=$(mktemp -d)

fail() { printf '%s\n' "$*" >&2; exit 1; }
command -v strace >/dev/null || fail "there is no strace: install the package strace"
[ -x "$leo" ] || fail "there is no $leo: run cargo build --release first, or say LEO=path/to/leo"

# The shell would say so when leo ends; strace and leo have children of their own to end.
stop() {
  kill -TERM "$robot" 2>/dev/null || true
  wait "$robot" 2>/dev/null || true
  rm -rf "$scratch"
}
XDG_STATE_HOME=$scratch "$leo" run --for 3600 --domain "$domain" >/dev/null 2>"$scratch/said" &
robot=$!
trap stop EXIT

# A number of a process's row: top PROCESS KEY
top() {
  "$leo" top --json --domain "$domain" 2>/dev/null | awk -v process="\"$1\"," -v key="\"$2\":" '
    $1 == "\"process\":" { here = $2 == process }
    here && $1 == key { sub(",", "", $2); print $2 }'
}

warm() {
  local cycles
  for _ in $(seq 300); do
    kill -0 "$robot" 2>/dev/null || fail "leo ended: $(cat "$scratch/said")"
    cycles=$(top motor cycles || true)
    [ "${cycles:-0}" -gt 2000 ] && return
    sleep 0.2
  done
  fail "the motor process did not get to 2000 cycles"
}

# count TITLE PROCESS STRACE-FLAGS...
count() {
  local title=$1 process=$2 pid before after
  shift 2
  pid=$(top "$process" pid)
  before=$(top "$process" cycles)
  timeout --signal INT "$seconds" strace -qq -c "$@" -o "$scratch/$process" -p "$pid" 2>"$scratch/strace" || true
  after=$(top "$process" cycles)
  [ -s "$scratch/$process" ] || fail "strace counted nothing: $(cat "$scratch/strace")"
  awk -v title="$title" -v cycles=$((after - before)) '
    /^ *[0-9.]+ +[0-9.]+ +[0-9]+ +[0-9]+ / && $NF != "total" {
      errors = NF == 6 ? sprintf("%.2f", $5 / cycles) : "0.00"
      if ($4 / cycles >= 0.005) printf "| %s | `%s` | %.2f | %s |\n", title, $NF, $4 / cycles, errors
      title = ""
    }
    END { printf "| | (cycles) | %d | |\n", cycles }' "$scratch/$process"
}

warm
printf '| process | system call | per cycle | of these failed |\n|---|---|---:|---:|\n'
count sensor sensor -f
count belief belief -f
count 'motor, cycle' motor
count 'motor, all threads' motor -f
