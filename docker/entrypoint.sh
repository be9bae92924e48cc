#!/bin/sh
# Starts the program in a container: delegates the container's control group to the ordinary user `faceoff`, and changes to that user.
# usage: entrypoint.sh COMMAND …
#
# A control group with processes cannot give memory limits to child groups, and the container's group has processes, such as
# this shell. So they are moved to a leaf group, which the sandbox expects, and the controllers are enabled for child groups
# before the program starts.
#
# Missing features are reported, and the command is started anyway: it refuses what it cannot do.
set -eu
user=faceoff
missing() { echo "entrypoint: agents cannot be bounded here: $*" >&2; }
if [ "$(id -u)" -ne 0 ]; then
    missing "only root can delegate control groups, and this container starts as another user (leave out --user, or runAsUser)"
    exec "$@"
fi
# The same rights as with the systemd unit: no capabilities, and no way to regain them.
ordinary() {
    # Volumes belong to root if the engine does not copy the image's folder.
    for folder in /data /scratch; do
        [ ! -d $folder ] || [ "$(stat -c %U $folder)" = $user ] || chown $user: $folder
    done
    exec setpriv --reuid $user --regid $user --init-groups --inh-caps=-all --bounding-set=-all --no-new-privs "$@"
}

top=/sys/fs/cgroup
privileged="start it privileged, with a cgroup namespace of its own (docker run --privileged --cgroupns=private)"
if [ ! -e $top/cgroup.controllers ]; then
    if [ -d $top/memory ] && [ -w $top/memory ]; then
        echo "entrypoint: control groups have version 1, which cannot be delegated: the command runs as root" >&2
        exec "$@"
    fi
    if [ -d $top/memory ]; then
        missing "the container's control groups, of version 1, are read-only: $privileged"
    else
        missing "there is no control group at $top"
    fi
    ordinary "$@"
fi
own=$top$(sed -n 's/^0:://p' /proc/self/cgroup)
own=${own%/}
own=${own%/faceoff-service}
if [ ! -d "$own" ] || [ ! -w "$own/cgroup.procs" ] || ! mkdir -p "$own/faceoff-service" 2>/dev/null; then
    missing "the container's control group is read-only: $privileged"
    ordinary "$@"
fi
for controller in memory pids cpu; do
    grep -qw $controller "$own/cgroup.controllers" || missing "the container's control group has no controller $controller"
done
# Processes may end or start others meanwhile; repeat until those have moved too.
for _ in 1 2 3 4 5; do
    while read -r process; do
        echo "$process" >"$own/faceoff-service/cgroup.procs" 2>/dev/null || true
    done <"$own/cgroup.procs"
done
# Not for the real root group, which has no cgroup.type: it may have both processes and controllers.
if [ -e "$own/cgroup.type" ] && [ -n "$(cat "$own/cgroup.procs")" ]; then
    missing "processes from outside of the container are in its control group, and cannot be moved from here"
fi
for controller in memory pids cpu cpuset; do
    ! grep -qw $controller "$own/cgroup.controllers" || echo +$controller 2>/dev/null >"$own/cgroup.subtree_control" ||
        missing "the container's control group does not enable $controller for child groups"
done
# The files that an owner of child groups needs, as in systemd's delegation; the container's own limits stay with root.
for file in . cgroup.procs cgroup.threads cgroup.subtree_control faceoff-service faceoff-service/cgroup.procs; do
    chown $user: "$own/$file"
done
ordinary "$@"
