#!/bin/sh
# Makes the wheel of the Python package, and tests it where nothing but that wheel is installed.
#   test.sh wheel       one wheel in TARGET/wheels, for glibc 2.17 and later: zig links it
#   test.sh test [...]  a wheel for this host's glibc of the development build, as the programs are that it is compared with;
#                       pytest where it alone is installed. The rest of the arguments goes to pytest
#   test.sh learning    that wheel beside the libraries that need torch; the examples learn anew
#   test.sh versions    the environments' tests, of the wheel in TARGET/wheels, by each interpreter of PYTHONS
# TARGET_DIR (default: target), PYTHON (default: python3) and PYTHONS (default: PYTHON) may be set.
#
# Programs of an environment are started by its interpreter: their first lines name it, and a path with a space is none there.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
target=${TARGET_DIR:-$root/target}
mkdir -p "$target"
target=$(cd "$target" && pwd)
python=${PYTHON:-python3}

# An environment with what a file requires, made again only when the file has changed.
environment() {
    wanted=$(cksum < "$2")
    if [ "$(cat "$1/made-of" 2>/dev/null)" != "$wanted" ]; then
        rm -rf "$1"
        "$python" -m venv "$1"
        "$1/bin/python" -m pip install --quiet --disable-pip-version-check -r "$2"
        echo "$wanted" > "$1/made-of"
    fi
}

# Makes a wheel in a folder; the rest are arguments of maturin.
wheel() {
    environment "$target/python-build" "$here/requirements-build.txt"
    out=$1
    shift
    rm -rf "$out"
    # The interpreter is named so that one of an active environment is not taken; abi3 makes it one for all.
    (cd "$here" && PATH="$target/python-build/bin:$PATH" CARGO_TARGET_DIR="$target" \
        "$target/python-build/bin/python" -m maturin build --quiet --locked --interpreter "$python" --out "$out" "$@")
    ls "$out"/*.whl
}

case ${1:-} in
    wheel)
        wheel "$target/wheels" --release --zig --target x86_64-unknown-linux-gnu --compatibility manylinux2014
        ;;
    test)
        shift
        wheel "$target/wheels-of-this-host" --features as-in-the-workspace
        environment "$target/python-test" "$here/requirements-test.txt"
        "$target/python-test/bin/python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps \
            "$target"/wheels-of-this-host/*.whl
        # Elsewhere than beside the sources, which would be imported in place of what is installed.
        cd "$target"
        "$target/python-test/bin/python" -m mypy --config-file "$here/pyproject.toml" "$here/python/faceoff"
        "$target/python-test/bin/python" -m mypy --config-file "$here/pyproject.toml" "$root"/agents/examples/*.py
        export TARGET_DIR="$target" FACEOFF_BIN="${FACEOFF_BIN:-$target/debug/faceoff}"
        FACEOFF_OLD_READERS="$target/python-old-readers" FACEOFF_SKIP_NOTHING=1 \
            "$target/python-test/bin/python" -m pytest -p no:cacheprovider -rs --durations 12 --rootdir "$here" \
            "$here/tests" "$root/agents/examples" "$@"
        ;;
    learning)
        shift
        wheel "$target/wheels-of-this-host" --release
        environment "$target/python-learning" "$here/tests_learning/requirements.txt"
        "$target/python-learning/bin/python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps \
            "$target"/wheels-of-this-host/*.whl
        cd "$target"
        TARGET_DIR="$target" "$target/python-learning/bin/python" -m pytest -p no:cacheprovider -rs --durations 12 \
            --rootdir "$here" "$here/tests_learning" "$@"
        ;;
    versions)
        for one in ${PYTHONS:-$python}; do
            rm -rf "$target/python-version"
            "$one" -m venv "$target/python-version"
            "$target/python-version/bin/python" -m pip install --quiet --disable-pip-version-check \
                "$target"/wheels/*.whl "gymnasium${GYMNASIUM:-}" pettingzoo pytest
            cd "$target"
            "$target/python-version/bin/python" -VV
            "$target/python-version/bin/python" -m pytest --quiet -p no:cacheprovider --rootdir "$here" \
                "$here/tests/test_gym_env.py" "$here/tests/test_gym_vector.py" "$here/tests/test_game.py" \
                "$here/tests/test_bad_input.py" "$here/tests/test_processes.py"
        done
        ;;
    *)
        echo "usage: $0 wheel | test [PYTEST ARGUMENTS] | learning [PYTEST ARGUMENTS] | versions" >&2
        exit 2
        ;;
esac
