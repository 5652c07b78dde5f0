#!/usr/bin/env bash
# Hostile call sequences under valgrind's memcheck:  tools/valgrind.sh [SEQUENCES]
# Needs valgrind and `cargo build --release`.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
export TRUEUP_BIN="$target/release/trueup" TRUEUP_HOSTILE_SEQUENCES="${1:-300}" RUST_BACKTRACE=0
unset TRUEUP_FMUS
program=$(cargo test --release -p trueup-acceptance --test integration --no-run --message-format json |
  grep -o '"executable":"[^"]*"' | cut -d'"' -f4)
# The dynamic loader loses a few bytes of its own per library.
loader=$(mktemp)
trap 'rm -f "$loader"' EXIT
printf '{\n dlopen\n Memcheck:Leak\n ...\n fun:dl_open_worker_begin\n ...\n}\n' >"$loader"
valgrind --error-exitcode=1 --leak-check=full --errors-for-leak-kinds=definite --show-leak-kinds=definite \
  --suppressions="$loader" "$program" hostile:: --test-threads 1
