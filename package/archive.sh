#!/usr/bin/env bash
# Builds an archive for machines without a build environment: package/archive.sh [--quick | --program FILE FOLDER].
# Prints its path as its last line. The archive holds the stripped program, manual pages, shell completions and the
# configuration; `install.sh` in it copies them below a prefix. Needs a Rust toolchain and a C compiler. --quick packs an
# unoptimised program. --program builds nothing: it packs the program FILE into an archive in FOLDER.
set -euo pipefail

case "${1:-}" in
--program)
  program="$(realpath "${2:?the program}")"
  folder="$(realpath "${3:?the folder of the archive}")"
  cd "$(dirname "${BASH_SOURCE[0]}")/.."
  ;;
--quick | '')
  cd "$(dirname "${BASH_SOURCE[0]}")/.."
  profile="$([ "${1:-}" = --quick ] && echo dev || echo release)"
  cargo build --locked --profile "$profile" --bin leo >&2
  target="$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')"
  folder="$target/$([ "$profile" = dev ] && echo debug || echo release)"
  program="$folder/leo"
  ;;
*)
  sed -n 2,5p "$0" >&2
  exit 2
  ;;
esac

version="$("$program" --version | cut -d ' ' -f 2)"
name="leo-$version-$(uname -m)-linux"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
root="$work/$name"

mkdir -p "$root"/{bin,share/man/man1,share/bash-completion/completions,share/zsh/site-functions} \
  "$root"/share/{fish/vendor_completions.d,leo,doc/leo}
strip -o "$root/bin/leo" "$program"
"$program" manual "$work/manual"
gzip --best --no-name "$work"/manual/man/*.1
cp "$work"/manual/man/*.1.gz "$root/share/man/man1/"
cp "$work/manual/completions/leo.bash" "$root/share/bash-completion/completions/leo"
cp "$work/manual/completions/_leo" "$root/share/zsh/site-functions/"
cp "$work/manual/completions/leo.fish" "$root/share/fish/vendor_completions.d/"
cp -r config/. "$root/share/leo/"
cp README.md LICENSE* docs/CHANGELOG.md docs/operations.md "$root/share/doc/leo/"
cp package/install.sh "$root/"
tar --create --gzip --owner=0 --group=0 --file "$folder/$name.tar.gz" --directory "$work" "$name"
echo "$folder/$name.tar.gz"
