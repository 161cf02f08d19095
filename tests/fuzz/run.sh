#!/usr/bin/env bash
# Runs the fuzz targets, as many side by side as there are cores:
#
#   tests/fuzz/run.sh 30s [TARGET..]          each for so many seconds
#   tests/fuzz/run.sh 100000000 [TARGET..]    each until it was fed so many bytes
#
# Fails when one panics, takes longer than ten seconds for an input, or needs more than a gigabyte; the input is kept
# in tests/fuzz/artifacts then. Needs cargo-fuzz (`cargo install cargo-fuzz`) and no nightly toolchain: the code is free
# of `unsafe`, so that no sanitizer is needed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

[[ ${1:-} =~ ^[0-9]+s?$ ]] || { sed -n '2,6p' "${BASH_SOURCE[0]}"; exit 2; }
amount=$1
shift
targets=("$@")
if [ ${#targets[@]} = 0 ]; then
  for file in tests/fuzz/targets/*.rs; do targets+=("$(basename "$file" .rs)"); done
fi
cargo fuzz build --fuzz-dir tests/fuzz --sanitizer none
built=${CARGO_TARGET_DIR:-tests/fuzz/target}/$(rustc -vV | sed -n 's/^host: //p')/release

run() {
  local target=$1 log=$logs/$1 status=0
  mkdir -p "tests/fuzz/corpus/$target" "tests/fuzz/artifacts/$target"
  local options=(-timeout=10 -rss_limit_mb=1024 "-artifact_prefix=tests/fuzz/artifacts/$target/")
  if [[ $amount = *s ]]; then
    options+=("-max_total_time=${amount%s}")
  else
    options+=(-len_control=0)
    export LEO_FUZZ_BYTES=$amount
  fi
  "$built/$target" "${options[@]}" "tests/fuzz/corpus/$target" >"$log" 2>&1 || status=$?
  # 72 is an interruption: it was fed enough.
  if [ $status = 0 ] || { [ $status = 72 ] && grep -q '^fed ' "$log"; }; then
    echo "$target: $(grep -E '^(Done|fed) ' "$log" | tail -1)"
  else
    tail -40 "$log"
    echo "$target: FAILED with status $status"
    return 1
  fi
}

logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
export -f run
export amount built logs
printf '%s\n' "${targets[@]}" | xargs -P "${FUZZ_JOBS:-$(nproc)}" -I{} bash -euo pipefail -c 'run {}'
