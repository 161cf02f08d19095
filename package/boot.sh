#!/usr/bin/env bash
# Tests the package's service under a systemd of its own: package/boot.sh PACKAGE.deb.
# It runs in namespaces, over a temporary copy of this machine's root, and takes two to four minutes. The test starts
# the service, lets its watchdog expire, takes away its real-time rights, an adapter and the disk space, shifts its
# clock by a year, and stops it. The machine's own clock does not change: the service sees the clock of libfaketime,
# which the script downloads if necessary. Needs root, overlayfs, systemd and curl.
set -euo pipefail

if [ "${1:-}" != --inside ]; then
  package="$(realpath "${1:?the package}")"
  out="$(mktemp -d)"
  trap 'rm -rf "$out"' EXIT
  compgen -G '/usr/lib/*/faketime/libfaketimeMT.so.1' >/dev/null || (cd "$out" && apt-get download --quiet=2 libfaketime)
  # A network namespace, because another program of this machine may use the port of the page.
  unshare --mount --pid --fork --uts --ipc --cgroup --net --propagation private "$0" --inside "$package" "$out" >"$out/boot" 2>&1 || true
  cat "$out/told" 2>/dev/null || cat "$out/boot"
  grep -qx 'all is well' "$out/told"
  exit
fi
package="$2"
out="$3"

# All mounts below end with the namespace.
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

# The kernel is shared with the machine, so the test loads no driver.
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

# The journal since the last start, and its lines of a priority.
said() { journalctl "_SYSTEMD_INVOCATION_ID=$(show InvocationID)" --no-pager -o cat "$@"; }
urgent() { said -u leo -p "$1"; }
fail() { said | tail -40; echo "$1"; exit 1; }
until_said() {
  for _ in $(seq 60); do if [[ "$(said)" = *"$1"* ]]; then return; fi; sleep 1; done
  fail "it does not say \`$1\`"
}

# The metrics, read with the token of the page.
metrics() { curl -s -H "Authorization: Bearer $(cut -d' ' -f2 /dev/shm/leo-robot/page)" http://127.0.0.1:7780/metrics; }
# The value of a metric, by its name and labels.
metric() { metrics | awk -v name="$1" '$1 == name { print $2 }'; }
until_metric() {
  for _ in $(seq 60); do if [ "$(metric "$1")" = "$2" ]; then return; fi; sleep 1; done
  fail "$1 is \`$(metric "$1")\`, not \`$2\`"
}
until_all_follow() { until_metric 'leo_joints{mode="following"}' 65; }
as_leo=(setpriv --reuid leo --regid leo --init-groups)
# The number of joints that were ever read, and the largest movement of a joint within five seconds, in radians.
moved() {
  for _ in $(seq 10); do
    metrics | grep '^leo_joint_position_radians' || true
    sleep 0.5
  done | awk '
    !($1 in low) || $2 < low[$1] { low[$1] = $2 }
    !($1 in high) || $2 > high[$1] { high[$1] = $2 }
    END { for (joint in low) { read++; most = high[joint] - low[joint] > most ? high[joint] - low[joint] : most }; printf "%d %.3f\n", read, most }'
}

# The supervisor never gives up, so only the watchdog can end the service.
sed -i 's/^max_deaths = .*/max_deaths = 1000000/' /etc/leo/leo.toml
systemctl start leo
expect state "$(show ActiveState)" active
expect status "$(show StatusText)" "all 7 processes run"
expect user "$(show User)" leo
supervisor="$(show MainPID)"
expect seccomp "$(grep Seccomp: "/proc/$supervisor/status")" "*2"
# Bit 23 is CAP_SYS_NICE: only the supervisor may change the priority of kernel workers.
expect "the supervisor's capabilities" "$(grep CapEff: "/proc/$supervisor/status")" "*0000000000800000"
for child in $(pgrep -P "$supervisor"); do
  expect "a process's capabilities" "$(grep CapEff: "/proc/$child/status")" "*0000000000000000"
done
echo "started: $(show StatusText)"
# Without CAP_SYS_RESOURCE (bit 24) systemd cannot grant the rights.
granted=$((0x$(sed -n 's/^CapEff:\s*//p' /proc/1/status) >> 24 & 1))
if [ "$granted" = 1 ]; then
  until_said "watches how to do"
  expect "warnings of its rights" "$(said | grep -c 'timing is not guaranteed')" 0
  echo "with its rights: $(show StatusText)"
else
  echo "with its rights: not tested, systemd cannot grant them here"
fi

# Without this file no process can join the domain.
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
# A manual start resets the restart counter. Nothing below may make systemd restart the service.
passed() { expect restarts "$(show NRestarts)" 0; echo "$1: $(show StatusText)"; }

printf '[Service]\nLimitRTPRIO=0\nLimitMEMLOCK=65536\nAmbientCapabilities=\n' | changed
systemctl restart leo
until_is StatusText "all 7 processes run"
until_said "timing is not guaranteed"
expect "warnings of its rights" "$(said | grep -c 'timing is not guaranteed')" 1
# The journal has it at warning priority, and no other line at that priority.
expect "urgent warnings of its rights" "$(urgent warning | grep -c 'timing is not guaranteed')" 1
expect "news among the warnings" "$(urgent warning | grep -c 'the robot runs')" 0
expect "errors" "$(urgent err)" ""
passed "without its rights"
printf '' | changed

# A right is lost during the run: the next incarnation of a process detects it.
systemctl restart leo
until_is StatusText "all 7 processes run"
until_all_follow
missing='leo_process_missing_right{process="motor",right="priority"}'
expect "the right, missing before" "$(metric "$missing")" "$((1 - granted))"
"${as_leo[@]}" prlimit --pid "$(show MainPID)" --rtprio=0
kill -KILL "$(pgrep -P "$(show MainPID)" -f "leo motor")"
until_said "died and starts anew"
until_metric "$missing" 1
until_is StatusText "all 7 processes run"
until_all_follow
passed "a right taken away$([ "$granted" = 1 ] || echo ", which cannot be granted here")"

# An adapter: mock servos outside the service, which are attached to this path or detached.
mkdir /run/adapter
cp /etc/leo/*.toml /etc/leo/leo.urdf /run/adapter
sed -i '0,/device = "mock"/s//device = "\/dev\/ttyUSB9"/' /etc/leo/motor.toml
bus="$(sed -n 's/^name = "\(.*\)"$/\1/p' /etc/leo/motor.toml | head -1)"
plug_in() {
  "${as_leo[@]}" leo mock-bus --config /run/adapter/leo.toml </dev/null >/run/adapter/told 2>&1 &
  adapter=$!
  for _ in $(seq 60); do if grep -q "^$bus " /run/adapter/told; then break; fi; sleep 1; done
  expect "what the mock servos say" "$(cat /run/adapter/told)" "*baud*"
  # The service cannot see the folder of the mock's own symbolic link.
  ln -sf "$(readlink "$(awk -v bus="$bus" '$1 == bus { print $2 }' /run/adapter/told)")" /dev/ttyUSB9
}
systemctl restart leo
until_is StatusText "all 7 processes run"
until_said "cannot open /dev/ttyUSB9"
until_said "watches how to do"
expect "how many joints were read, and how far one moves, without an adapter" "$(moved)" "49 0.00[0-4]"
expect "the lost bus" "$(metric "leo_bus_lost{bus=\"$bus\"}")" 1
until_said "I learned"
passed "without an adapter, no joint moves"
plug_in
until_all_follow
expect "the lost bus" "$(metric "leo_bus_lost{bus=\"$bus\"}")" 0
passed "its adapter is plugged in, all joints follow"
# The adapter disappears while the joints move.
systemctl restart leo
until_said "performs task 1"
until_all_follow
expect "how many joints were read, and how far one moves" "$(moved)" "65 [0-9].[1-9]??"
kill "$adapter"
rm /dev/ttyUSB9
until_metric "leo_bus_lost{bus=\"$bus\"}" 1
expect "how many joints were read, and how far one moves, after an adapter went" "$(moved)" "65 0.00[0-4]"
expect "joints that follow, after an adapter went" "$(metric 'leo_joints{mode="following"}')" 0
plug_in
until_all_follow
expect lives "$(said | grep -c 'starts anew')" 0
passed "its adapter went and came back, all joints follow"
sed -i 's/"\/dev\/ttyUSB9"/"mock"/' /etc/leo/motor.toml
kill "$adapter"

systemctl stop leo
rm -rf /var/lib/leo
mkdir /var/lib/leo
mount -t tmpfs -o size=40m tmpfs /var/lib/leo
systemctl start leo
until_said "watches how to do"
recording=/var/lib/leo/recording.mcap
"${as_leo[@]}" leo record --domain /dev/shm/leo-robot "$recording" >/run/recorded 2>&1 &
recorder=$!
for _ in $(seq 60); do if [ -s "$recording" ]; then break; fi; sleep 1; done
expect "the recording before" "$(cat /run/recorded)" ""
# Less than a twentieth of the disk is free: the recording ends complete, before the disk is full for the robot.
fallocate -l "$(($(df --output=avail -B1 /var/lib/leo | tail -1) - 1500000))" /var/lib/leo/most
status=0
wait "$recorder" || status=$?
expect "the recorder's exit status" "$status" 1
expect "what the recorder says" "$(cat /run/recorded)" "leo: $recording: less than 3 MB of its disk are free*is whole"
expect "lines that the recorder says" "$(wc -l </run/recorded)" 1
# The magic bytes at the end of a complete MCAP file.
expect "the recording's end" "$(tail -c 8 "$recording" | od -An -tx1 | tr -d ' ')" 894d434150300d0a
expect "what could not be written" "$(urgent err)" ""
dd if=/dev/zero of=/var/lib/leo/fill bs=1k 2>/dev/null || true
until_said "I cannot remember it beyond today"
expect "errors of the disk" "$(urgent err | grep -c 'it is tried again')" "[1-9]*"
rm /var/lib/leo/fill
until_said "Now I can remember it beyond today"
expect lives "$(said | grep -c 'starts anew')" 0
until_all_follow
passed "with a full disk, and a recording that ended whole"
rm /var/lib/leo/most "$recording"

# The service sees the machine's wall clock plus the offset in this file. The monotonic clock does not change.
clock=/run/wrong-clock
jump() { echo "$1" >"$clock.new"; mv "$clock.new" "$clock"; }
# Offset of the page's clock from the machine's, in seconds.
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
# After a jump back, a running server repeats its last date until the clock passes it. A restart shows the new time.
systemctl restart leo
until_is StatusText "all 7 processes run"
until_ahead "-3153[56]???"
until_all_follow
expect lives "$(said | grep -c 'starts anew')" 0
passed "with a wrong clock from the start"

# The robot moves when it is stopped.
until_said "performs task 1"
until_all_follow
life="$(show InvocationID)"
systemctl stop leo
expect result "$(show Result)" success
expect "exit status" "$(show ExecMainStatus)" 0
journalctl --sync
expect "how often every servo said that its torque is off" \
  "$(journalctl "_SYSTEMD_INVOCATION_ID=$life" --no-pager -o cat | grep -c 'every servo says that its torque is off')" 1
echo "stopped: every servo says that its torque is off"
# libfaketime leaves files of killed processes.
expect "shared memory" "$(ls /dev/shm | grep -v faketime || true)" ""
test -s /var/lib/leo/learned.store
echo "all is well"
PROBE
exec env -i container=lxc PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  chroot "$root" /lib/systemd/systemd --system --unit=probe.service --show-status=no
