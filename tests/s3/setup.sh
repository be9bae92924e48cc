#!/bin/sh
# Creates TARGET_DIR/s3-test, a virtual environment with an S3 server for tests.
set -eu
here=$(dirname "$(realpath "$0")")
exec "$here/../python-environment.sh" "${TARGET_DIR:-target}/s3-test" "$here/requirements.txt"
