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
report_missing() { echo "entrypoint: agents cannot be bounded here: $*" >&2; }
if [ "$(id -u)" -ne 0 ]; then
    report_missing "only root can delegate control groups, and this container starts as another user (leave out --user, or runAsUser)"
    exec "$@"
fi
# Runs the command as the ordinary user, with the same rights as with the systemd unit: no capabilities, and no way to regain them.
run_as_user() {
    # Volumes belong to root if the engine does not copy the image's folder.
    for folder in /data /scratch; do
        [ ! -d $folder ] || [ "$(stat -c %U $folder)" = $user ] || chown $user: $folder
    done
    exec setpriv --reuid $user --regid $user --init-groups --inh-caps=-all --bounding-set=-all --no-new-privs "$@"
}

top=/sys/fs/cgroup
advice="start it privileged, with a cgroup namespace of its own (docker run --privileged --cgroupns=private)"
if [ ! -e $top/cgroup.controllers ]; then
    if [ -d $top/memory ] && [ -w $top/memory ]; then
        echo "entrypoint: control groups have version 1, which cannot be delegated: the command runs as root" >&2
        exec "$@"
    fi
    if [ -d $top/memory ]; then
        report_missing "the container's control groups, of version 1, are read-only: $advice"
    else
        report_missing "there is no control group at $top"
    fi
    run_as_user "$@"
fi
own_group=$top$(sed -n 's/^0:://p' /proc/self/cgroup)
own_group=${own_group%/}
own_group=${own_group%/faceoff-service}
if [ ! -d "$own_group" ] || [ ! -w "$own_group/cgroup.procs" ] || ! mkdir -p "$own_group/faceoff-service" 2>/dev/null; then
    report_missing "the container's control group is read-only: $advice"
    run_as_user "$@"
fi
for controller in memory pids cpu; do
    grep -qw $controller "$own_group/cgroup.controllers" || report_missing "the container's control group has no controller $controller"
done
# Processes may end or start others meanwhile, so the move is repeated.
for _ in 1 2 3 4 5; do
    while read -r process; do
        echo "$process" >"$own_group/faceoff-service/cgroup.procs" 2>/dev/null || true
    done <"$own_group/cgroup.procs"
done
# Not for the real root group, which has no cgroup.type: it may have both processes and controllers.
if [ -e "$own_group/cgroup.type" ] && [ -n "$(cat "$own_group/cgroup.procs")" ]; then
    report_missing "processes from outside of the container are in its control group, and cannot be moved from here"
fi
for controller in memory pids cpu cpuset; do
    ! grep -qw $controller "$own_group/cgroup.controllers" || echo +$controller 2>/dev/null >"$own_group/cgroup.subtree_control" ||
        report_missing "the container's control group does not enable $controller for child groups"
done
# The files that an owner of child groups needs, as in systemd's delegation; the container's own limits stay with root.
for file in . cgroup.procs cgroup.threads cgroup.subtree_control faceoff-service faceoff-service/cgroup.procs; do
    chown $user: "$own_group/$file"
done
run_as_user "$@"
