#!/bin/sh
# Builds the agent and copies it into the bundle.
set -eu
cd "$(dirname "$0")"
cargo build --release --target-dir target
cp target/release/{{name}} bundle/agent
