#!/bin/sh
# Tests the wheel that `make test-python` has built with the Python of newer Debian releases: 3.13 and 3.14. As root, because each test runs
# in that release's files, which are made once in TARGET_DIR/python-roots.
#
#   tests/python-versions.sh [RELEASE ...]      default: trixie forky; TARGET_DIR (default: target) may be set
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
target=${TARGET_DIR:-$root/target}
mkdir -p "$target/python-roots"
target=$(cd "$target" && pwd)
[ $# -gt 0 ] || set -- trixie forky

for release in "$@"; do
    files=$target/python-roots/$release
    if [ ! -e "$files.made" ]; then
        rm -rf "$files"
        # In a mount namespace of its own: if this is interrupted, its mounts end with it.
        # Mirrors may hold an older state of a release.
        unshare --mount mmdebstrap --quiet --variant=minbase --aptopt='Acquire::Check-Valid-Until "false"' \
            --include=python3,python3-venv,bubblewrap,ca-certificates,git,libgomp1,mount "$release" "$files"
        touch "$files.made"
    fi
    unshare --mount --propagation private sh -eu -s "$files" "$root" "$target" <<'INSIDE'
files=$1 root=$2 target=$3
mount --bind "$files" "$files"
mount --rbind /proc "$files/proc"
mount --rbind /dev "$files/dev"
mount --rbind /sys "$files/sys"
for shared in "$root" "$target"; do
    mkdir -p "$files$shared"
    mount --bind "$shared" "$files$shared"
done
# Network and package index as on this host.
for setting in /etc/resolv.conf /etc/hosts /etc/pip.conf /etc/ssl/certs/ca-certificates.crt; do
    [ -e "$setting" ] || continue
    touch "$files$setting"
    mount --bind "$setting" "$files$setting"
done
export HOME=/root PATH=/usr/sbin:/usr/bin:/bin PYTHONS=python3 TARGET_DIR="$target" WHEELS="$target/wheels-of-this-host"
# Not chroot: in one, the kernel refuses the namespaces of the sandbox.
mkdir -p "$files/host"
cd "$files"
pivot_root . host
cd "$root"
umount --lazy /host
exec crates/faceoff-py/test.sh versions
INSIDE
done
