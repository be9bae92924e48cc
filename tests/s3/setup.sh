#!/bin/sh
# Creates TARGET_DIR/s3-test, a virtual environment with an S3 server for tests. Creates it again if the requirements have changed.
set -eu
here=$(dirname "$(realpath "$0")")
: "${TARGET_DIR:=target}"
environment=$TARGET_DIR/s3-test
if ! cmp --silent "$here/requirements.txt" "$environment/requirements.txt"; then
    rm -rf "$environment"
    "${PYTHON:-python3}" -m venv "$environment"
    "$environment/bin/python" -m pip install --quiet --disable-pip-version-check -r "$here/requirements.txt"
    cp "$here/requirements.txt" "$environment/requirements.txt"
fi
