#!/usr/bin/env bash
# Builds the static program and lays out the folder that deploy/Containerfile is built from.
#   deploy/static.sh                    target/container: motorcade, data/
# The libraries are those of `cargo build --release`; only the program itself is compiled and linked anew. glibc, whose allocator is quicker with
# threads than musl's. target/release/motorcade is this program too, until `cargo build` links the ordinary one again.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo rustc --release --locked -p motorcade-cli --bin motorcade -- -C target-feature=+crt-static
rm -rf target/container
mkdir -p target/container/data
install -m 755 target/release/motorcade target/container/motorcade
