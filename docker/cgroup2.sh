#!/bin/sh
# Tries the sandbox's limits on version 2 of the cgroup interface, whatever this host has: boots Debian's kernel in a virtual
# machine without version 1, whose root is this host's, read-only and with a layer in memory above it, and runs what was built.
#
#   TARGET_DIR=target docker/cgroup2.sh      (after cargo build --workspace --bins --tests; docker/setup.sh cgroup2)
#
# CGROUP2_TIMEOUT_S ends a machine that hangs. Kernel and log stay in TARGET_DIR/cgroup2. The CPU is emulated, which takes minutes: on
# a host that is itself a virtual machine, an ordinary kernel may hang with the /dev/kvm that is there, and nothing tells before.
#
# A process meets its cgroup in one of five ways, and each of them is tried:
#   top        in the hierarchy's real top. It is the one cgroup that may have processes and give out controllers at once.
#   leaf       in a cgroup below, as root: it is busy (it has processes), so it gives out no controller until they have moved.
#   container  in the top of a cgroup namespace. It looks like the real one and is busy like any other.
#   user       in a cgroup that an ordinary user was given, as by systemd's Delegate=yes.
#   image      as container, through docker/entrypoint.sh, which does both: it empties the top and gives it to an ordinary user; and
#              in a busy cgroup without a namespace, as privileged pods are.
set -eu
: "${TARGET_DIR:=target}" "${CGROUP2_TIMEOUT_S:=3600}"
folder=$(dirname "$(realpath "$0")")
if [ "$(uname -m)" != x86_64 ]; then
    echo "error: this script knows the virtual machines of x86_64 only, and this is $(uname -m)" >&2
    exit 1
fi
program=$(realpath "$TARGET_DIR/debug/faceoff")
# Every crate's integration tests are called `it`: the newest that have this module.
tests_with() { # tests_with MODULE CRATE
    found=$(find "$(realpath "$TARGET_DIR/debug/deps")" -name 'it-*' ! -name '*.*' -type f -perm -u+x -printf '%T@ %p\n' | sort -rn |
        cut -d' ' -f2- | while IFS= read -r candidate; do
        if "$candidate" --list </dev/null 2>/dev/null | grep -q "^$1::.*: test\$"; then
            echo "$candidate"
            break
        fi
    done)
    if [ -z "$found" ]; then
        echo "error: no tests of $2 in $TARGET_DIR/debug/deps: cargo build --locked --workspace --bins --tests" >&2
        exit 1
    fi
    echo "$found"
}
tests=$(tests_with process_limits faceoff-sandbox)
runner_tests=$(tests_with early_cpu_time faceoff-runner)
work=$(mkdir -p "$TARGET_DIR/cgroup2" && realpath "$TARGET_DIR/cgroup2")

# The kernel is unpacked, not installed: nothing of it reaches this host's /boot.
package=$(apt-cache depends linux-image-amd64 | awk '$1 == "Depends:" { print $2; exit }')
if [ ! -e "$work/$package" ]; then
    rm -rf "$work/unpacked"
    mkdir "$work/unpacked"
    (cd "$work/unpacked" && apt-get download -qq -o APT::Sandbox::User=root "$package")
    dpkg --fsys-tarfile "$work/unpacked/$package"_*.deb | tar -x -C "$work/unpacked" --wildcards './boot/vmlinuz-*' \
        './lib/modules/*/kernel/drivers/virtio/*' './lib/modules/*/kernel/net/9p/*' './lib/modules/*/kernel/fs/*'
    rm "$work/unpacked/$package"_*.deb
    mv "$work/unpacked" "$work/$package"
fi

initramfs=$work/initramfs
rm -rf "$initramfs"
version=${package#linux-image-}
modules=$initramfs/lib/modules/$version
mkdir -p "$initramfs/bin" "$modules" "$initramfs/host" "$initramfs/memory" "$initramfs/root"
cp "$(command -v busybox)" "$initramfs/bin/busybox"
# Some kernels have built in, or joined, some of them.
for module in virtio virtio_ring virtio_pci_legacy_dev virtio_pci_modern_dev virtio_pci netfs fscache 9pnet 9pnet_virtio 9p overlay; do
    find "$work/$package/lib/modules" \( -name "$module.ko" -o -name "$module.ko.xz" \) -exec cp {} "$modules" \;
done
find "$modules" -name '*.xz' -exec xz -d {} +
busybox depmod -b "$initramfs" "$version"
cat >"$initramfs/init" <<'END'
#!/bin/busybox sh
# When a step fails, process 1 ends, the kernel panics, and the machine is off.
set -eu
/bin/busybox mkdir -p /proc /sys /dev
/bin/busybox mount -t proc proc /proc
/bin/busybox mount -t devtmpfs dev /dev
for module in virtio_pci 9pnet_virtio 9p overlay; do /bin/busybox modprobe "$module"; done
/bin/busybox mount -t 9p -o trans=virtio,version=9p2000.L,ro,cache=loose,msize=524288 host /host
/bin/busybox mount -t tmpfs -o mode=755 memory /memory
/bin/busybox mkdir /memory/upper /memory/work
/bin/busybox mount -t overlay -o lowerdir=/host,upperdir=/memory/upper,workdir=/memory/work root /root
for folder in tmp run dev/shm; do
    /bin/busybox mkdir -p "/root/$folder"
done
/bin/busybox mount --move /dev /root/dev
/bin/busybox mount --move /proc /root/proc
/bin/busybox mount -t sysfs sys /root/sys
/bin/busybox mount -t cgroup2 cgroup2 /root/sys/fs/cgroup
/bin/busybox mkdir -p /root/dev/shm /root/dev/pts
/bin/busybox mount -t devpts pts /root/dev/pts
# Not /tmp, which may hold the repository: the host's is as good, with the layer above it.
for folder in run dev/shm; do
    /bin/busybox mount -t tmpfs -o mode=1777 memory "/root/$folder"
done
/bin/busybox cp /cases /root/run/cases
exec /bin/busybox switch_root /root /bin/sh /run/cases
END
chmod 755 "$initramfs/init"

{
    printf "program='%s'\ntests='%s'\nrunner_tests='%s'\nrepository='%s'\n" "$program" "$tests" "$runner_tests" "$(dirname "$folder")"
    cat <<'END'
set -u
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/run/scratch TMPDIR=/run/scratch
export entrypoint="$repository/docker/entrypoint.sh"
top=/sys/fs/cgroup
failed=''
case_is() { printf '\n===== %s\n' "$*"; }
expect() { # expect NAME COMMAND…
    name=$1
    shift
    "$@" || failed="$failed $name"
}
# The sandbox's own tests that meet a cgroup: limits, ends, CPUs, and what a killed service leaves.
limits() {
    "$tests" --test-threads 1 resource_limits:: process_limits:: cpu_limits:: cpu_count:: process_cleanup:: \
        killed_service:: exit_causes:: probe:: normal_operation:: channel_blocking::
}
# The evaluator's, attacked by agents that hold it, or that compute while nobody waits for them.
attacks() {
    "$runner_tests" --test-threads 1 early_cpu_time:: supervision:: unread_questions:: waits_of_helpers
}
# All of doctor's layers, with version 2 in three of them. The exit status alone would leave out by which version.
doctor() {
    cd "$TMPDIR" && "$program" doctor >doctor.$$
    status=$?
    cat doctor.$$
    [ "$status" = 0 ] && [ "$(grep -c 'cgroup v2, limits accepted' doctor.$$)" = 3 ]
}
END
    cat <<'END'
if [ "${1:-}" = run ]; then
    "$2"
    exit
fi
mkdir -m 1777 "$TMPDIR"
uname -sr
grep cgroup /proc/mounts
ip link set lo up 2>/dev/null || /bin/busybox ip link set lo up
echo "controllers: $(cat $top/cgroup.controllers)"
# An agent that asks for more than this machine has is to meet its limit, not a kernel that gives nothing out at all.
echo 1 >/proc/sys/vm/overcommit_memory
# An ordinary user has no way into a home folder; here it does, in memory.
for path in "$tests" "$runner_tests" "$program" "$repository/tests/agents/exceeds_limits.py"; do
    while path=$(dirname "$path") && [ "$path" != / ]; do chmod a+x "$path"; done
done

case_is "top: doctor in the hierarchy's real top, with all processes of this machine"
expect top-doctor sh "$0" run doctor
# As it was: the cases below are given the controllers by name.
for group in $top/*/; do rmdir "$group" 2>/dev/null; done
echo '+memory +pids +cpu +cpuset' >$top/cgroup.subtree_control || failed="$failed controllers"

case_is "leaf: doctor, then the sandbox's tests, as root in a busy cgroup"
mkdir $top/leaf
# The kernel's word is EBUSY for memory. Processes and CPU time it lets a busy cgroup give out, which thereby becomes a threaded one: then
# memory is refused with EOPNOTSUPP, and a group below takes no process in.
printf 'a busy cgroup does not give out memory: '
sh -c "echo 0 >$top/leaf/cgroup.procs; echo +memory >$top/leaf/cgroup.subtree_control" 2>&1 && failed="$failed leaf-busy"
expect leaf-doctor sh -c "echo 0 >$top/leaf/cgroup.procs; exec sh '$0' run doctor"
mkdir $top/leaf-tests
expect leaf-tests sh -c "echo 0 >$top/leaf-tests/cgroup.procs; exec sh '$0' run limits"

case_is "leaf: agents that attack the evaluator's clock, as root in a busy cgroup"
mkdir $top/leaf-attacks
expect leaf-attacks sh -c "echo 0 >$top/leaf-attacks/cgroup.procs; exec sh '$0' run attacks"

case_is "container: the same in the top of a cgroup namespace"
mkdir $top/container
expect container sh -c "echo 0 >$top/container/cgroup.procs
    exec unshare --cgroup --mount sh -c 'umount $top && mount -t cgroup2 cgroup2 $top && cat /proc/self/cgroup &&
        sh $0 run doctor && sh $0 run limits'"

case_is "user: the same as an ordinary user with a cgroup of its own"
mkdir $top/user
chown 1234:1234 $top/user $top/user/cgroup.procs $top/user/cgroup.threads $top/user/cgroup.subtree_control
expect user sh -c "echo 0 >$top/user/cgroup.procs
    exec setpriv --reuid 1234 --regid 1234 --clear-groups sh -c 'sh $0 run doctor && sh $0 run limits'"

case_is "image: the same as the image's user, through docker/entrypoint.sh in the top of a cgroup namespace"
useradd --system --user-group --uid 990 faceoff
mkdir $top/image
expect image sh -c "echo 0 >$top/image/cgroup.procs
    exec unshare --cgroup --mount sh -c 'umount $top && mount -t cgroup2 cgroup2 $top &&
        \"\$entrypoint\" id -un && \"\$entrypoint\" sh $0 run doctor && \"\$entrypoint\" sh $0 run limits'"

case_is "image: doctor in a busy cgroup without a namespace of its own, as in privileged pods"
mkdir $top/pod
expect image-pod sh -c "echo 0 >$top/pod/cgroup.procs; exec \"\$entrypoint\" sh $0 run doctor"

case_is "partial: doctor in a busy cgroup that is offered pids and cpu, and no memory"
mkdir $top/partial
echo '+pids +cpu' >$top/partial/cgroup.subtree_control
mkdir $top/partial/service
# What is missing there is memory alone.
expect partial sh -c "echo 0 >$top/partial/service/cgroup.procs; cd $TMPDIR; '$program' doctor >partial; cat partial
    [ \"\$(grep -c 'cgroup v2, limits accepted' partial)\" = 2 ]"

case_is "what is left"
find $top -type d -name 'agent-*' | grep . && failed="$failed left-behind"
[ -z "$failed" ] && echo "everything passed" || echo "failed:$failed"
echo "result:${failed:- passed}" >/dev/ttyS1
sync
/bin/busybox poweroff -f
END
} >"$initramfs/cases"
(cd "$initramfs" && find . | cpio --quiet -o -H newc | gzip -1) >"$work/initramfs.gz"
rm -rf "$initramfs"

rm -f "$work/result"
echo "booting $package; the log is $work/log"
# With a file as input it takes no keys of the terminal, and stops for none.
timeout --kill-after=10 "$CGROUP2_TIMEOUT_S" qemu-system-x86_64 -accel tcg -cpu max -smp 2 -m 4096 \
    -nodefaults -no-user-config -display none -no-reboot \
    -kernel "$work/$package"/boot/vmlinuz-* -initrd "$work/initramfs.gz" \
    -append 'console=ttyS0 quiet panic=-1 cgroup_no_v1=all' \
    -virtfs local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap \
    -serial stdio -serial "file:$work/result" </dev/null 2>&1 | tee "$work/log" || true
case $(tr -d '\r' <"$work/result" 2>/dev/null) in
"result: passed") ;;
result:*) exit 1 ;;
*)
    echo "error: the machine ended, or was ended after $CGROUP2_TIMEOUT_S s, before its tests did" >&2
    exit 1
    ;;
esac
