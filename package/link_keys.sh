#!/usr/bin/env bash
# Creates the keys of a link between two machines, see docs/more_than_one_machine.md.
#   link_keys.sh FOLDER robot=DNS:leo.local,IP:192.0.2.7 remote=DNS:desk.local
# Writes to FOLDER: authority.pem for both machines, NAME.pem and NAME.key for one each, and authority.key. Keep
# authority.key away from both machines: its holder can sign a certificate for any machine.
set -euo pipefail
[ $# -ge 2 ] || { sed -n 2,5p "$0" >&2; exit 2; }
umask 077
folder=$1
shift
mkdir -p "$folder"
cd "$folder"
key=(-newkey ec -pkeyopt ec_paramgen_curve:P-256 -noenc)

if ! [ -e authority.key ]; then
  openssl req -x509 "${key[@]}" -days 3650 -subj "/CN=the authority of a link of Leo" \
    -addext basicConstraints=critical,CA:TRUE -addext keyUsage=critical,keyCertSign \
    -keyout authority.key -out authority.pem 2>/dev/null
fi
for machine in "$@"; do
  name=${machine%%=*}
  printf 'subjectAltName=%s\nextendedKeyUsage=serverAuth,clientAuth\n' "${machine#*=}" >"$name.ext"
  openssl req -new "${key[@]}" -subj "/CN=$name" -keyout "$name.key" -out "$name.csr" 2>/dev/null
  openssl x509 -req -in "$name.csr" -CA authority.pem -CAkey authority.key -days 825 -extfile "$name.ext" -out "$name.pem" 2>/dev/null
  rm "$name.csr" "$name.ext"
done
