#!/usr/bin/env bash
# Runs the package's service under a systemd of its own, in namespaces over a copy of this machine's root that is
# thrown away: package/boot.sh PACKAGE.deb. It starts it, starves its watchdog by a process that hangs and
# cannot be replaced, sees it started anew, takes away its real-time rights, an adapter and the room on its disk,
# has its clock jump by a year, and stops it: two minutes or four. The machine's own clock is left alone: there is
# one for all namespaces, and what the service takes for it is libfaketime's, which is fetched where the machine lacks
# it. Needs root, overlayfs, systemd and curl.
set -euo pipefail

if [ "${1:-}" != --inside ]; then
  package="$(realpath "${1:?the package}")"
  out="$(mktemp -d)"
  trap 'rm -rf "$out"' EXIT
  compgen -G '/usr/lib/*/faketime/libfaketimeMT.so.1' >/dev/null || (cd "$out" && apt-get download --quiet=2 libfaketime)
  # In a network of its own, whatever has the page's port on this machine.
  unshare --mount --pid --fork --uts --ipc --cgroup --net --propagation private "$0" --inside "$package" "$out" >"$out/boot" 2>&1 || true
  cat "$out/told" 2>/dev/null || cat "$out/boot"
  grep -qx 'all is well' "$out/told"
  exit
fi
package="$2"
out="$3"

# Everything mounted from here on goes with the namespace.
copy="$out/copy"
mkdir "$copy"
mount -t tmpfs tmpfs "$copy"
mkdir "$copy"/{upper,work,root}
mount -t overlay overlay -o "lowerdir=/,upperdir=$copy/upper,workdir=$copy/work" "$copy/root"
root="$copy/root"
mount -t proc proc "$root/proc"
mount --rbind /sys "$root/sys"
mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"
mount -t tmpfs tmpfs "$root/dev"
for device in null zero full random urandom tty; do
  touch "$root/dev/$device"
  mount --bind "/dev/$device" "$root/dev/$device"
done
mkdir "$root/dev/pts" "$root/dev/shm" "$root/probe"
mount -t devpts -o newinstance,ptmxmode=0666,mode=620,gid=5 devpts "$root/dev/pts"
ln -s pts/ptmx "$root/dev/ptmx"
mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm"
for place in run tmp; do mount -t tmpfs tmpfs "$root/$place"; done
cp "$package" "$out/leo.deb"
mount --bind "$out" "$root/probe"
chroot "$root" sh -c 'dpkg -i /probe/*.deb'

# The kernel is the machine's own: no driver is loaded into it.
for driver in usbserial cdc_acm; do ln -s /dev/null "$root/etc/systemd/system/modprobe@$driver.service"; done
cat >"$root/etc/systemd/system/probe.service" <<'UNIT'
[Service]
Type=oneshot
StandardOutput=file:/probe/told
StandardError=inherit
ExecStart=/bin/bash /probe/probe.sh
ExecStopPost=/bin/systemctl exit
UNIT
cat >"$root/probe/probe.sh" <<'PROBE'
set -euo pipefail
show() { systemctl show leo --value -p "$1"; }
expect() { if [[ "$2" != $3 ]]; then echo "$1 is \`$2\`, not \`$3\`"; journalctl -u leo --no-pager | tail -40; exit 1; fi; }
until_is() { for _ in $(seq 60); do if [ "$(show "$1")" = "$2" ]; then return; fi; sleep 1; done; expect "$1" "$(show "$1")" "$2"; }

# What the robot has said since it was started last.
said() { journalctl "_SYSTEMD_INVOCATION_ID=$(show InvocationID)" --no-pager -o cat; }
fail() { said | tail -40; echo "$1"; exit 1; }
until_said() {
  for _ in $(seq 60); do if [[ "$(said)" = *"$1"* ]]; then return; fi; sleep 1; done
  fail "it does not say \`$1\`"
}

# A number of the metrics, by its name and labels.
metric() { curl -s http://127.0.0.1:7780/metrics | awk -v name="$1" '$1 == name { print $2 }'; }
until_metric() {
  for _ in $(seq 60); do if [ "$(metric "$1")" = "$2" ]; then return; fi; sleep 1; done
  fail "$1 is \`$(metric "$1")\`, not \`$2\`"
}
until_all_follow() { until_metric 'leo_joints{mode="following"}' 65; }

# A supervisor that never gives up by itself: what is left is the watchdog.
sed -i 's/^deaths_most = .*/deaths_most = 1000000/' /etc/leo/leo.toml
systemctl start leo
expect state "$(show ActiveState)" active
expect status "$(show StatusText)" "all 7 processes run"
expect user "$(show User)" leo
supervisor="$(show MainPID)"
expect seccomp "$(grep Seccomp: "/proc/$supervisor/status")" "*2"
# Bit 23 is CAP_SYS_NICE: the supervisor may change the kernel's workers, and nobody else anything.
expect "the supervisor's capabilities" "$(grep CapEff: "/proc/$supervisor/status")" "*0000000000800000"
for child in $(pgrep -P "$supervisor"); do
  expect "a process's capabilities" "$(grep CapEff: "/proc/$child/status")" "*0000000000000000"
done
echo "started: $(show StatusText)"
# What systemd itself may not raise, it cannot grant: bit 24 is CAP_SYS_RESOURCE.
if (( 0x$(sed -n 's/^CapEff:\s*//p' /proc/1/status) >> 24 & 1 )); then
  until_said "watches how to do"
  expect "warnings of its rights" "$(said | grep -c 'timing is not guaranteed')" 0
  echo "with its rights: $(show StatusText)"
else
  echo "with its rights: not tried, nobody can be granted any here"
fi

# Nobody can join the domain any more.
rm /dev/shm/leo-robot/iceoryx2.toml
kill -STOP "$(pgrep -P "$supervisor" -f "leo belief")"
until_is StatusText "6 of 7 processes run, the others are being replaced"
until_is Result watchdog
echo "starved: $(show Result)"
until_is StatusText "all 7 processes run"
expect restarts "$(show NRestarts)" "[1-5]"
[ "$(show MainPID)" != "$supervisor" ]
echo "started anew: $(show StatusText)"

changed() { mkdir -p /etc/systemd/system/leo.service.d; cat >/etc/systemd/system/leo.service.d/probe.conf; systemctl daemon-reload; }
# Who starts it by hand begins to count anew: nothing of what follows may make systemd start it again.
passed() { expect restarts "$(show NRestarts)" 0; echo "$1: $(show StatusText)"; }

printf '[Service]\nLimitRTPRIO=0\nLimitMEMLOCK=65536\nAmbientCapabilities=\n' | changed
systemctl restart leo
until_is StatusText "all 7 processes run"
until_said "timing is not guaranteed"
expect "warnings of its rights" "$(said | grep -c 'timing is not guaranteed')" 1
passed "without its rights"
printf '' | changed

sed -i '0,/device = "mock"/s//device = "\/dev\/ttyUSB9"/' /etc/leo/motor.toml
systemctl restart leo
until_is StatusText "all 7 processes run"
until_said "cannot open /dev/ttyUSB9"
until_said "I learned"
sed -i 's/"\/dev\/ttyUSB9"/"mock"/' /etc/leo/motor.toml
passed "without an adapter"

systemctl stop leo
rm -rf /var/lib/leo
mkdir /var/lib/leo
mount -t tmpfs -o size=6m tmpfs /var/lib/leo
systemctl start leo
until_said "watches how to do"
dd if=/dev/zero of=/var/lib/leo/fill bs=1k 2>/dev/null || true
until_said "I cannot remember it beyond today"
rm /var/lib/leo/fill
until_said "Now I can remember it beyond today"
passed "with a full disk"

# What the service takes for the time is the machine's, and as much more as this file says; of how long things take
# nothing is changed.
clock=/run/wrong-clock
jump() { echo "$1" >"$clock.new"; mv "$clock.new" "$clock"; }
# How far its page is ahead of the machine, in seconds.
ahead() { echo $(($(date -d "$(curl -sI http://127.0.0.1:7780/ | sed -n 's/^date: //Ip' | tr -d '\r')" +%s) - $(date +%s))); }
until_ahead() {
  for _ in $(seq 20); do if [[ "$(ahead)" = $1 ]]; then return; fi; sleep 1; done
  fail "its clock is ahead by $(ahead), not $1 seconds"
}
jump +0
changed <<UNIT
[Service]
Environment=LD_PRELOAD=$(echo /usr/lib/*/faketime/libfaketimeMT.so.1) FAKETIME_TIMESTAMP_FILE=$clock
Environment=DONT_FAKE_MONOTONIC=1 NO_FAKE_STAT=1 FAKETIME_NO_CACHE=1
UNIT
systemctl stop leo
rm -rf /var/lib/leo/*
systemctl start leo
until_said "watches how to do"
until_all_follow
expect "how far its clock is ahead" "$(ahead)" "?(-)[0-9]"
jump +1y
until_ahead "3153[56]???"
sleep 5
expect "status a year ahead" "$(show StatusText)" "all 7 processes run"
until_all_follow
jump -1y
sleep 5
expect "status a year behind" "$(show StatusText)" "all 7 processes run"
until_all_follow
until_said "I learned"
expect lives "$(said | grep -c 'starts anew')" 0
passed "its clock jumped a year ahead and two years back"
# What a page was told last of the time it is told until the time has come there: only who begins now tells what it is.
systemctl restart leo
until_is StatusText "all 7 processes run"
until_ahead "-3153[56]???"
until_all_follow
expect lives "$(said | grep -c 'starts anew')" 0
passed "with a wrong clock from the start"

systemctl stop leo
expect result "$(show Result)" success
expect "exit status" "$(show ExecMainStatus)" 0
# What libfaketime leaves of processes that were killed is not Leo's.
expect "shared memory" "$(ls /dev/shm | grep -v faketime || true)" ""
test -s /var/lib/leo/learned.redb
echo "all is well"
PROBE
exec env -i container=lxc PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  chroot "$root" /lib/systemd/systemd --system --unit=probe.service --show-status=no
