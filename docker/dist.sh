#!/bin/sh
# Packs the program for other Linux machines of this architecture with the C library below or a newer one.
# The packed program has passed check-program.sh.
# usage: dist.sh PROGRAM FOLDER      (PROGRAM: for example target/release/faceoff)
set -eu
if [ $# -ne 2 ]; then
    echo "usage: $0 PROGRAM FOLDER" >&2
    exit 2
fi
program=$1 folder=$2
# Debian 12, Ubuntu 22.04, Fedora 35 and RHEL 9 have this version or a newer one.
newest_glibc=2.34

needed=$(objdump -T "$program" | grep -o 'GLIBC_[0-9][0-9.]*' | sort -uV | tail -1)
needed=${needed#GLIBC_}
if [ "$(printf '%s\n' "$needed" "$newest_glibc" | sort -V | tail -1)" != "$newest_glibc" ]; then
    echo "error: $program needs glibc $needed, at most $newest_glibc is allowed: build on an older system" >&2
    exit 1
fi
# It may only need libraries that every system has.
other_libraries=$(objdump -p "$program" | awk '$1 == "NEEDED" { print $2 }' | grep -Ev '^(libc|libm|libgcc_s|ld-linux-.*)\.so' || true)
if [ -n "$other_libraries" ]; then
    echo "error: $program needs libraries that not every Linux has: $other_libraries" >&2
    exit 1
fi
name="faceoff-$("$program" --version | cut -d' ' -f2)-$(uname -m)-linux"
trap 'rm -rf "${folder:?}/$name"' EXIT
mkdir -p "$folder/$name"
install -m 755 "$program" "$folder/$name/faceoff"
"$(dirname "$0")/check-program.sh" "$folder/$name/faceoff"
tar -C "$folder" --owner=0 --group=0 -czf "$folder/$name.tar.gz" "$name"
(cd "$folder" && sha256sum "$name.tar.gz" | tee "$name.tar.gz.sha256")
echo "needs glibc $needed or newer: $folder/$name.tar.gz"
