#!/usr/bin/env bash
# Hostile call sequences under valgrind's memcheck:  tools/valgrind.sh [SEQUENCES]
# Needs valgrind and `cargo build --release`.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
export TRUEUP_BIN="$target/release/trueup" TRUEUP_HOSTILE_SEQUENCES="${1:-300}" RUST_BACKTRACE=0
unset TRUEUP_FMUS
program=$(cargo test --release -p trueup-acceptance --test hostile --no-run --message-format json |
  grep -o '"executable":"[^"]*"' | cut -d'"' -f4)
# Symbols that the C library keeps to its end are no leak of ours: only what is definitely lost counts.
exec valgrind --error-exitcode=1 --leak-check=full --errors-for-leak-kinds=definite --show-leak-kinds=definite \
  "$program" --test-threads 1
