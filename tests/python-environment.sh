#!/bin/sh
# Creates a virtual environment with the packages of a requirements file, again only when the file has changed.
#
#   tests/python-environment.sh FOLDER REQUIREMENTS     PYTHON (default: python3) may be set
#
# uv installs the packages: it needs a tenth of pip's CPU time, because it unpacks each package once for all environments and does
# not compile its modules. pip installs what uv cannot, for example from an index that only pip is configured for.
set -eu
folder=$1
requirements=$2
python=${PYTHON:-python3}

wanted=$(cat "$requirements"; "$python" -VV)
[ "$(cat "$folder/made-of" 2>/dev/null)" != "$wanted" ] || exit 0

# One uv for all environments beside this one. Of several scripts at once, the first installs it.
mkdir -p "$(dirname "$folder")"
tools=$(cd "$(dirname "$folder")" && pwd)/python-uv
UV=0.13.9
(
    flock 9
    if [ "$(cat "$tools/made-of" 2>/dev/null)" != "$UV" ]; then
        rm -rf "$tools"
        "$python" -m venv "$tools"
        "$tools/bin/python" -m pip install --quiet --disable-pip-version-check --no-compile "uv==$UV"
        echo "$UV" > "$tools/made-of"
    fi
) 9> "$tools.lock"

rm -rf "$folder"
"$tools/bin/uv" venv --quiet --seed --python "$(command -v "$python")" "$folder"
"$tools/bin/uv" pip install --quiet --python "$folder/bin/python" --requirement "$requirements" ||
    "$folder/bin/python" -m pip install --quiet --disable-pip-version-check --no-compile --requirement "$requirements"
echo "$wanted" > "$folder/made-of"
