#!/usr/bin/env bash
# Installs, runs, upgrades, removes and purges the package in a temporary copy of this machine's root:
# package/try.sh OLD.deb NEW.deb. Fails if a step fails, or if the purge leaves a file.
# Needs root, overlayfs, and the dependencies of the package. The machine itself does not change.
set -euo pipefail

if [ "${1:-}" != --inside ]; then
  old="$(realpath "${1:?the older package}")"
  new="$(realpath "${2:?the newer package}")"
  exec unshare --mount --propagation private "$0" --inside "$old" "$new"
fi
old="$2"
new="$3"

copy="$(mktemp -d)"
trap 'umount --recursive --lazy "$copy"; rmdir "$copy"' EXIT
mount -t tmpfs tmpfs "$copy"
mkdir "$copy"/{upper,work,root}
mount -t overlay overlay -o "lowerdir=/,upperdir=$copy/upper,workdir=$copy/work" "$copy/root"
for place in proc sys dev; do mount --rbind "/$place" "$copy/root/$place"; done
for place in run tmp; do mount -t tmpfs tmpfs "$copy/root/$place"; done
cp "$old" "$copy/root/tmp/old.deb"
cp "$new" "$copy/root/tmp/new.deb"

inside() { env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive chroot "$copy/root" "$@"; }
as_leo() { inside setpriv --reuid leo --regid leo --init-groups env XDG_STATE_HOME=/var/lib "$@"; }
# Every file with its owner, mode and link target, and the checksums of /etc. Excludes the files of dpkg and the backups
# of user databases.
picture() {
  inside find /etc /usr /var /opt /srv /home \
    \( -path /var/lib/dpkg -o -path /var/log -o -path /var/cache -o -path /var/tmp \) -prune -o \
    ! -path '/etc/*-' ! -path /etc/.pwd.lock -printf '%p %M %u %g %l\n' | sort
  inside find /etc -type f ! -path '/etc/*-' ! -path /etc/.pwd.lock -exec sha256sum {} + | sort
}
say() { printf '== %s\n' "$*"; }
expect() { if ! inside sh -c "$1"; then printf 'failed: %s\n' "$1" >&2; exit 1; fi; }

picture >"$copy/before"

say install
inside dpkg -i /tmp/old.deb
expect 'test "$(leo --version)" != ""'
expect 'getent passwd leo | grep -q :/usr/sbin/nologin'
expect 'id -nG leo | grep -qw dialout'
expect 'test -f /usr/lib/udev/rules.d/60-leo.rules -a -f /usr/share/man/man1/leo-run.1.gz'
expect 'test ! -e /etc/systemd/system/multi-user.target.wants/leo.service'
expect 'systemd-analyze verify --man=no /usr/lib/systemd/system/leo.service'

say "run as its user, and keep the learned tasks"
inside install -d -o leo -g leo -m 750 /var/lib/leo
as_leo leo check --config /etc/leo/leo.toml --seconds 0 | sed 's/^/   /'
as_leo leo run --config /etc/leo/leo.toml --domain /dev/shm/leo-try --for 12 >"$copy/told"
grep -q 'What Leo learned' "$copy/told"
as_leo leo tasks list | sed 's/^/   /'
expect 'test -s /var/lib/leo/learned.store'

say "upgrade, with a changed file"
inside sh -c 'echo "# of this robot" >>/etc/leo/leo.toml'
inside dpkg -i /tmp/new.deb
expect 'tail -1 /etc/leo/leo.toml | grep -qx "# of this robot"'
expect 'test -z "$(find /etc/leo -name "*.dpkg-*")"'
as_leo leo tasks list >"$copy/tasks"
grep -q . "$copy/tasks"

say remove
inside dpkg -r leo
expect 'test ! -e /usr/bin/leo -a ! -e /usr/lib/systemd/system/leo.service'
expect 'test -f /etc/leo/leo.toml -a -s /var/lib/leo/learned.store'

say purge
inside dpkg -P leo
picture >"$copy/after"
if ! diff "$copy/before" "$copy/after"; then
  printf 'left behind or changed: see above\n' >&2
  exit 1
fi
if ls /dev/shm | grep -q '^leo-try'; then
  printf 'left behind in shared memory\n' >&2
  exit 1
fi
say "nothing is left behind"
