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
cargo build --locked --profile "$profile" --bin leo >&2

target="$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')"
built="$target/$([ "$profile" = dev ] && echo debug || echo release)"
# The error of `cargo deb` alone names this folder.
manual="$built/written-by-package-build.sh"
rm -rf "$manual"
"$built/leo" manual "$manual"
gzip --best --no-name "$manual"/man/*.1
cargo deb --no-build --locked --profile "$profile" ${PACKAGE_VERSION:+--deb-version "$PACKAGE_VERSION"}
