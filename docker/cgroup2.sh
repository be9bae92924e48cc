#!/bin/sh
# Tests the sandbox's limits on cgroup v2, on any host: boots Debian's kernel in a virtual machine without v1 and runs the built
# tests. The machine's root is this host's root, read-only, with a layer in memory.
#
#   TARGET_DIR=target docker/cgroup2.sh      (after cargo build --workspace --bins --tests; docker/setup.sh cgroup2)
#
# CGROUP2_ONLY names cases, separated by spaces, such as `leaf-tests leaf-languages`; by default all are tested.
# CGROUP2_TIMEOUT_S ends a hanging machine. Kernel and log stay in TARGET_DIR/cgroup2. The CPU is emulated, which takes minutes: if the
# host is itself a virtual machine, a kernel may hang with /dev/kvm, and this cannot be detected in advance.
#
# A process can have one of five kinds of cgroup, and all are tested:
#   top        the real root cgroup. Only this one may have processes and enable controllers for children at once.
#   leaf       a cgroup below it, as root. It is busy (it has processes), so it cannot enable controllers until they have moved.
#   container  the root of a cgroup namespace. It looks like the real root and is busy like any other.
#   user       a cgroup that was delegated to an ordinary user, as by systemd's Delegate=yes.
#   image      as container, through docker/entrypoint.sh, which empties the root and delegates it to an ordinary user; also a busy
#              cgroup without a namespace, as in privileged pods.
set -eu
: "${TARGET_DIR:=target}" "${CGROUP2_ONLY:=}" "${CGROUP2_TIMEOUT_S:=3600}"
folder=$(dirname "$(realpath "$0")")
if [ "$(uname -m)" != x86_64 ]; then
    echo "error: this script supports only x86_64, and this is $(uname -m)" >&2
    exit 1
fi
program=$(realpath "$TARGET_DIR/debug/faceoff")
# The integration tests of every crate are called `it`: select the newest binary with this module.
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

# The kernel is unpacked, not installed: this host's /boot does not change.
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
# In some kernels some of these modules are built in or merged.
for module in virtio virtio_ring virtio_pci_legacy_dev virtio_pci_modern_dev virtio_pci netfs fscache 9pnet 9pnet_virtio 9p overlay; do
    find "$work/$package/lib/modules" \( -name "$module.ko" -o -name "$module.ko.xz" \) -exec cp {} "$modules" \;
done
find "$modules" -name '*.xz' -exec xz -d {} +
busybox depmod -b "$initramfs" "$version"
cat >"$initramfs/init" <<'END'
#!/bin/busybox sh
# If a step fails, process 1 ends, the kernel panics, and the machine stops.
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
# Not /tmp, which may contain the repository: the host's /tmp with the layer in memory works too.
for folder in run dev/shm; do
    /bin/busybox mount -t tmpfs -o mode=1777 memory "/root/$folder"
done
/bin/busybox cp /cases /root/run/cases
exec /bin/busybox switch_root /root /bin/sh /run/cases
END
chmod 755 "$initramfs/init"

{
    printf "program='%s'\ntests='%s'\nrunner_tests='%s'\nrepository='%s'\nlanguages='%s'\nonly='%s'\n" "$program" "$tests" "$runner_tests" "$(dirname "$folder")" \
        "$(realpath -m "$TARGET_DIR/languages")" "$CGROUP2_ONLY"
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
    case " ${only:-$name} " in
    *" $name "*) ;;
    *) return ;;
    esac
    "$@" || failed="$failed $name"
}
# The sandbox's tests that use a cgroup: limits, exits, CPUs, and cleanup after a killed service.
limits() {
    "$tests" --test-threads 1 resource_limits:: process_limits:: cpu_limits:: cpu_count:: process_cleanup:: \
        killed_service:: exit_causes:: probe:: normal_operation:: channel_blocking:: system_use::
}
# The tests of the evaluator, which asks agents and measures their time, with agents that block it or compute before they are asked.
attacks() {
    "$runner_tests" --test-threads 1 early_cpu_time:: supervision:: unread_questions:: waits_of_helpers
}
# Counters of the host and shared files as channels between agents.
channels() {
    "$tests" --test-threads 1 host_counters:: covert_channels::
}
# Agents in all languages, if `make test-languages` has prepared them.
languages() {
    if [ -e "$languages/faceoff.toml" ]; then
        /usr/bin/python3 "$repository/tests/languages/test_languages.py" --program "$program" --work "$languages" --prepared
    else
        echo "not tested: make test-languages prepares the agents"
    fi
}
# All checks of doctor, three of them with cgroup v2. The exit status alone does not show the version.
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
# An agent that requests more memory than this machine has must reach its limit, not a refusal of the kernel.
echo 1 >/proc/sys/vm/overcommit_memory
# An ordinary user cannot enter a home folder; allow it here, in the layer in memory.
for path in "$tests" "$runner_tests" "$program" "$repository/tests/agents/exceeds_limits.py"; do
    while path=$(dirname "$path") && [ "$path" != / ]; do chmod a+x "$path"; done
done

case_is "top: doctor in the real root cgroup, with all processes of this machine"
expect top-doctor sh "$0" run doctor
# Restore the initial state: the cases below enable the controllers by name.
for group in $top/*/; do rmdir "$group" 2>/dev/null; done
echo '+memory +pids +cpu +cpuset' >$top/cgroup.subtree_control || failed="$failed controllers"

case_is "leaf: doctor, then the sandbox's tests, as root in a busy cgroup"
mkdir $top/leaf
# The kernel returns EBUSY for memory. A busy cgroup can enable pids and cpu, and then becomes a threaded one: memory is refused with
# EOPNOTSUPP, and child groups accept no process.
printf 'a busy cgroup cannot enable memory: '
sh -c "echo 0 >$top/leaf/cgroup.procs; echo +memory >$top/leaf/cgroup.subtree_control" 2>&1 && failed="$failed leaf-busy"
expect leaf-doctor sh -c "echo 0 >$top/leaf/cgroup.procs; exec sh '$0' run doctor"
mkdir $top/leaf-tests
expect leaf-tests sh -c "echo 0 >$top/leaf-tests/cgroup.procs; exec sh '$0' run limits"

case_is "leaf: agents that attack the evaluator's clock, as root in a busy cgroup"
mkdir $top/leaf-attacks
expect leaf-attacks sh -c "echo 0 >$top/leaf-attacks/cgroup.procs; exec sh '$0' run attacks"

case_is "leaf: agents in all languages, as root in a busy cgroup"
mkdir $top/leaf-languages
expect leaf-languages sh -c "echo 0 >$top/leaf-languages/cgroup.procs; exec sh '$0' run languages"

case_is "leaf: channels between agents, as root in a busy cgroup"
mkdir $top/leaf-channels
expect leaf-channels sh -c "echo 0 >$top/leaf-channels/cgroup.procs; exec sh '$0' run channels"

case_is "container: the same in the root of a cgroup namespace"
mkdir $top/container
expect container sh -c "echo 0 >$top/container/cgroup.procs
    exec unshare --cgroup --mount sh -c 'umount $top && mount -t cgroup2 cgroup2 $top && cat /proc/self/cgroup &&
        sh $0 run doctor && sh $0 run limits'"

case_is "user: the same as an ordinary user with a cgroup of its own"
mkdir $top/user
chown 1234:1234 $top/user $top/user/cgroup.procs $top/user/cgroup.threads $top/user/cgroup.subtree_control
expect user sh -c "echo 0 >$top/user/cgroup.procs
    exec setpriv --reuid 1234 --regid 1234 --clear-groups sh -c 'sh $0 run doctor && sh $0 run limits'"

case_is "image: the same as the image's user, through docker/entrypoint.sh in the root of a cgroup namespace"
useradd --system --user-group --uid 990 faceoff
mkdir $top/image
expect image sh -c "echo 0 >$top/image/cgroup.procs
    exec unshare --cgroup --mount sh -c 'umount $top && mount -t cgroup2 cgroup2 $top &&
        \"\$entrypoint\" id -un && \"\$entrypoint\" sh $0 run doctor && \"\$entrypoint\" sh $0 run limits'"

case_is "image: doctor in a busy cgroup without a namespace of its own, as in privileged pods"
mkdir $top/pod
expect image-pod sh -c "echo 0 >$top/pod/cgroup.procs; exec \"\$entrypoint\" sh $0 run doctor"

case_is "partial: doctor in a busy cgroup with the controllers pids and cpu, without memory"
mkdir $top/partial
echo '+pids +cpu' >$top/partial/cgroup.subtree_control
mkdir $top/partial/service
# Only memory is missing there.
expect partial sh -c "echo 0 >$top/partial/service/cgroup.procs; cd $TMPDIR; '$program' doctor >partial; cat partial
    [ \"\$(grep -c 'cgroup v2, limits accepted' partial)\" = 2 ]"

case_is "remaining cgroups"
find $top -type d -name 'agent-*' | grep . && failed="$failed left-behind"
[ -z "$failed" ] && echo "all cases passed" || echo "failed:$failed"
echo "result:${failed:- passed}" >/dev/ttyS1
sync
/bin/busybox poweroff -f
END
} >"$initramfs/cases"
(cd "$initramfs" && find . | cpio --quiet -o -H newc | gzip -1) >"$work/initramfs.gz"
rm -rf "$initramfs"

rm -f "$work/result"
echo "booting $package; the log is $work/log"
# With /dev/null as input it does not read the terminal.
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
    echo "error: the machine ended before its tests, or was stopped after $CGROUP2_TIMEOUT_S s" >&2
    exit 1
    ;;
esac
