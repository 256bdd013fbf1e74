#!/usr/bin/env bash
# Fuzzes each target for SECONDS: scripts/fuzz.sh SECONDS TARGET... New inputs go to fuzz/grown/, what breaks something
# to fuzz/artifacts/ (both ignored by git). Readers are safe Rust: what can go wrong is a panic, a hang or too much memory, which
# need no sanitizer, and without one inputs run several times as fast. FUZZ_SANITIZER=address looks into libraries as well.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=$1
shift
cargo +nightly fuzz --version >/dev/null 2>&1 || {
    echo "fuzz: needs cargo-fuzz and a nightly toolchain: cargo install cargo-fuzz; rustup toolchain install nightly" >&2
    exit 1
}
cargo +nightly fuzz build --sanitizer "${FUZZ_SANITIZER:-none}" --fuzz-dir fuzz fuzz
# Symbols cost seconds an input in a program of this size; a crash is replayed by tests/integrity/fuzz_corpus.rs, which has them.
export ASAN_OPTIONS=detect_odr_violation=0:symbolize=0
broken=0
for target in "$@"; do
    mkdir -p "fuzz/grown/$target" "fuzz/artifacts/$target"
    echo "fuzz: $target, $seconds s"
    GRASPMILL_FUZZ_TARGET=$target fuzz/target/x86_64-unknown-linux-gnu/release/fuzz \
        -max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 -max_len=131072 -print_funcs=0 \
        -print_final_stats=1 -artifact_prefix="fuzz/artifacts/$target/" "fuzz/grown/$target" "fuzz/corpus/$target" || broken=1
done
exit $broken
