#!/bin/sh
# Copies the program, its manual pages, shell completions and configuration below a prefix: ./install.sh [PREFIX].
# The default is ~/.local. Needs no build environment.
set -eu
prefix="${1:-$HOME/.local}"
from="$(cd "$(dirname "$0")" && pwd)"
mkdir -p "$prefix"
cp -R "$from/bin" "$from/share" "$prefix/"
echo "leo is installed: $prefix/bin/leo"
