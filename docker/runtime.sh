#!/bin/sh
# Creates the runtime python3-ml in a folder: a virtual environment of this host's Python with NumPy, SciPy and ONNX
# Runtime, in the versions and with the hashes of docker/python3-ml/requirements.txt, without the host's packages.
#
#   docker/runtime.sh FOLDER                   create it; does nothing if it is up to date
#   docker/runtime.sh FOLDER PIP-ARGUMENTS …   also install packages with pip, without changing the versions above:
#       docker/runtime.sh FOLDER --index-url https://download.pytorch.org/whl/cpu torch
#
# PYTHON=/path/to/python3 selects the interpreter; the default is that of the runtime python3.
set -eu

here=$(cd "$(dirname "$0")" && pwd)/python3-ml
fail() {
    echo "error: $*" >&2
    exit 1
}

[ $# -ge 1 ] || fail "expected a folder: docker/runtime.sh FOLDER [PIP-ARGUMENTS …]"
folder=$1
shift
case $folder in
    /*) ;;
    *) folder=$PWD/$folder ;;
esac

python=${PYTHON:-}
for candidate in /usr/local/bin/python3 /usr/bin/python3 /bin/python3 /opt/python/bin/python3; do
    [ -n "$python" ] || [ ! -x "$candidate" ] || python=$candidate
done
[ -n "$python" ] || fail "no python3 in the usual folders; install it, or set PYTHON=/path/to/python3"
version=$("$python" -c 'import sys; print("%d.%d.%d" % sys.version_info[:3])') || fail "$python does not start"
case $version in
    3.11.* | 3.12.* | 3.13.* | 3.14.*) ;;
    *) fail "expected Python 3.11 to 3.14, got $version at $python; name another: PYTHON=/path/to/python3" ;;
esac

mkdir -p "$(dirname "$folder")"
# If two processes create it at once, the second finds it complete.
exec 9>"$folder.lock"
flock 9

stamp=$(
    {
        echo "$folder $python $version $*"
        cat "$here/requirements.txt" "$here/faceoff_threads.py" "$0"
    } | sha256sum | cut -d ' ' -f 1
)
if [ "$(cat "$folder/.faceoff-runtime" 2>/dev/null)" = "$stamp" ]; then
    exit 0
fi
if [ -e "$folder" ] && [ ! -e "$folder/.faceoff-runtime" ]; then
    fail "$folder exists and was not created by this script; pass a folder that does not exist"
fi

new=$folder.new
rm -rf "$new"
echo "creating $folder with Python $version of $python"
"$python" -m venv --without-pip "$new"
if "$python" -m pip --version >/dev/null 2>&1; then
    pip() { "$python" -m pip --python "$new/bin/python3" "$@"; }
elif "$new/bin/python3" -m ensurepip >/dev/null 2>&1; then
    pip() { "$new/bin/python3" -m pip "$@"; }
else
    fail "$python has no pip; run: apt-get install python3-pip"
fi
install() { pip --disable-pip-version-check install --quiet --no-input --only-binary :all: "$@"; }

install --require-hashes --no-deps --requirement "$here/requirements.txt"
if [ $# -gt 0 ]; then
    sed -n 's/^\([a-z][^ ]*==[^ ]*\).*/\1/p' "$here/requirements.txt" >"$new/constraints.txt"
    install --constraint "$new/constraints.txt" "$@"
    rm "$new/constraints.txt"
fi
if [ -d "$("$new/bin/python3" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/pip" ]; then
    "$new/bin/python3" -m pip --quiet uninstall --yes pip setuptools
fi

site=$("$new/bin/python3" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
cp "$here/faceoff_threads.py" "$site/"
echo 'import faceoff_threads' >"$site/faceoff_threads.pth"
"$new/bin/python3" -m compileall -q "$site/faceoff_threads.py"
# Scripts of packages have the path of a temporary folder in their first line, and agents run modules instead.
find "$new/bin" -type f ! -name 'python*' -delete
ORT_DISABLE_TELEMETRY=1 "$new/bin/python3" -I -c 'import numpy, scipy.linalg, onnxruntime' || fail "the packages do not load; see above"
# Agents run as other users.
chmod -R a+rX "$new"
echo "$stamp" >"$new/.faceoff-runtime"

rm -rf "$folder.old"
[ ! -e "$folder" ] || mv "$folder" "$folder.old"
mv "$new" "$folder"
rm -rf "$folder.old"
echo "add it to the server's configuration:"
echo "  [runtimes.python3-ml]"
echo "  folder = \"$folder\""
