#!/bin/sh
# Starts the program in a container: gives the ordinary user `faceoff` the container's control group, and becomes that user.
# usage: entrypoint.sh COMMAND …
#
# In a control group with processes of its own no memory limit can be given to a group below, and a container's own group has
# them: this shell, to begin with. So they move into a leaf, where the sandbox looks for its service, and the controllers are
# handed down before anything is started.
#
# What cannot be had is said, and the command is started all the same: it refuses by itself what it cannot do.
set -eu
user=faceoff
missing() { echo "entrypoint: agents cannot be bounded here: $*" >&2; }
if [ "$(id -u)" -ne 0 ]; then
    missing "control groups are handed out by root, and this container starts as another user (leave out --user, or runAsUser)"
    exec "$@"
fi
# As ordinary as the unit of systemd: nothing is left that a program with other rights could give back.
ordinary() {
    # Volumes come as root's, where the engine does not copy the image's folder.
    for folder in /data /scratch; do
        [ ! -d $folder ] || [ "$(stat -c %U $folder)" = $user ] || chown $user: $folder
    done
    exec setpriv --reuid $user --regid $user --init-groups --inh-caps=-all --bounding-set=-all --no-new-privs "$@"
}

top=/sys/fs/cgroup
privileged="start it privileged, with a cgroup namespace of its own (docker run --privileged --cgroupns=private)"
if [ ! -e $top/cgroup.controllers ]; then
    if [ -d $top/memory ] && [ -w $top/memory ]; then
        echo "entrypoint: control groups are of version 1, of which root hands none out: the command stays root" >&2
        exec "$@"
    fi
    if [ -d $top/memory ]; then
        missing "the container's control groups, which are of version 1, are read-only: $privileged"
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
# Some may end meanwhile, and whoever they have started since is found by another look.
for _ in 1 2 3 4 5; do
    while read -r process; do
        echo "$process" >"$own/faceoff-service/cgroup.procs" 2>/dev/null || true
    done <"$own/cgroup.procs"
done
# The real top is not asked: it alone may have both.
if [ -e "$own/cgroup.type" ] && [ -n "$(cat "$own/cgroup.procs")" ]; then
    missing "processes from outside of the container live in its control group, and cannot be moved from here"
fi
for controller in memory pids cpu cpuset; do
    ! grep -qw $controller "$own/cgroup.controllers" || echo +$controller 2>/dev/null >"$own/cgroup.subtree_control" ||
        missing "the container's control group does not hand down $controller"
done
# What an owner needs to have groups below, as systemd delegates them; the container's own limits stay root's.
for file in . cgroup.procs cgroup.threads cgroup.subtree_control faceoff-service faceoff-service/cgroup.procs; do
    chown $user: "$own/$file"
done
ordinary "$@"
