#!/usr/bin/env bash
# Builds the Debian package: package/build.sh [--quick]. Prints the path of the package as its last line.
# Needs a Rust toolchain and a C compiler; installs cargo-deb if it is missing. --quick packs an unoptimised program.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

profile=release
if [ "${1:-}" = --quick ]; then
  profile=dev
fi

cargo deb --version >/dev/null 2>&1 || cargo install cargo-deb --locked
cargo deb --locked --profile "$profile" ${PACKAGE_VERSION:+--deb-version "$PACKAGE_VERSION"}
