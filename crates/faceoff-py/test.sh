#!/bin/sh
# Builds the wheel of the Python package, and tests it in an environment without the sources.
#   test.sh wheel       one wheel in TARGET/wheels, for glibc 2.17 and later: zig links it; ARCH=aarch64 makes that of 64-bit ARM, for which
#                       Rust's standard library must be installed: rustup target add aarch64-unknown-linux-gnu
#   test.sh test [...]  a wheel of the development build for this host's glibc, like the programs it is compared with; runs
#                       pytest on it, with the remaining arguments
#   test.sh learning    the wheel with libraries that need torch; repeats the training of the examples
#   test.sh versions    the tests on the wheel in WHEELS, with each interpreter of PYTHONS (tests/python-versions.sh)
# TARGET_DIR (default: target), PYTHON (default: python3), PYTHONS (default: PYTHON) and WHEELS (default: TARGET/wheels) may be set,
# and for `versions` GYMNASIUM, such as ==1.1.1.
#
# Programs of an environment are started through its interpreter: shebang lines do not work with a space in the path.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
target=${TARGET_DIR:-$root/target}
mkdir -p "$target"
target=$(cd "$target" && pwd)
python=${PYTHON:-python3}

# Builds a wheel in a folder; the other arguments are maturin's.
wheel() {
    "$root/tests/python-environment.sh" "$target/python-build" "$here/requirements-build.txt"
    out=$1
    shift
    rm -rf "$out"
    # The interpreter is named so that an active environment is not used; abi3 makes the wheel valid for all versions.
    (cd "$here" && PATH="$target/python-build/bin:$PATH" CARGO_TARGET_DIR="$target" \
        "$target/python-build/bin/python" -m maturin build --quiet --locked --interpreter "$python" --out "$out" "$@")
    ls "$out"/*.whl
}

case ${1:-} in
    wheel)
        wheel "$target/wheels" --profile wheel --zig --target "${ARCH:-x86_64}-unknown-linux-gnu" --compatibility manylinux2014
        ;;
    test)
        shift
        wheel "$target/wheels-of-this-host" --features as-in-the-workspace
        "$root/tests/python-environment.sh" "$target/python-test" "$here/requirements-test.txt"
        "$target/python-test/bin/python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps \
            --no-compile "$target"/wheels-of-this-host/*.whl
        # Not in the sources' folder, because they would be imported instead of the installed wheel.
        cd "$target"
        "$target/python-test/bin/python" -m mypy --config-file "$here/pyproject.toml" "$here/python/faceoff"
        "$target/python-test/bin/python" -m mypy --config-file "$here/pyproject.toml" "$root"/agents/examples/*.py
        export TARGET_DIR="$target" FACEOFF_BIN="${FACEOFF_BIN:-$target/debug/faceoff}"
        # Threads of numpy's BLAS wait for each other in loops. Beside other tests, small matrices then take many times as long.
        export OPENBLAS_NUM_THREADS=1
        FACEOFF_READERS="$target/python-readers" FACEOFF_SKIP_NOTHING=1 \
            "$target/python-test/bin/python" -m pytest -p no:cacheprovider -rs --durations 12 --rootdir "$here" \
            "$here/tests" "$root/agents/examples" "$@"
        ;;
    learning)
        shift
        wheel "$target/wheels-of-this-host" --profile wheel
        "$root/tests/python-environment.sh" "$target/python-learning" "$here/tests_learning/requirements.txt"
        "$target/python-learning/bin/python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps \
            "$target"/wheels-of-this-host/*.whl
        cd "$target"
        TARGET_DIR="$target" "$target/python-learning/bin/python" -m pytest -p no:cacheprovider -rs --durations 12 \
            --rootdir "$here" "$here/tests_learning" "$@"
        ;;
    versions)
        for interpreter in ${PYTHONS:-$python}; do
            rm -rf "$target/python-version"
            "$interpreter" -m venv "$target/python-version"
            # Of the libraries, those that have a wheel for this version; tests of the others are skipped.
            sed 's/ *#.*//; /^$/d' "$here/requirements-test.txt" | while read -r requirement; do
                log=$target/python-version/$requirement.log
                "$target/python-version/bin/python" -m pip install --quiet --disable-pip-version-check --no-compile \
                    --only-binary :all: "$requirement" > "$log" 2>&1 && continue
                grep -q 'No matching distribution found' "$log" || { cat "$log" >&2; exit 1; }
                echo "no wheel for this version of Python: $requirement"
            done
            "$target/python-version/bin/python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps \
                "${WHEELS:-$target/wheels}"/*.whl
            [ -z "${GYMNASIUM:-}" ] || "$target/python-version/bin/python" -m pip install --quiet "gymnasium$GYMNASIUM"
            cd "$target"
            "$target/python-version/bin/python" -VV
            TARGET_DIR="$target" FACEOFF_BIN="${FACEOFF_BIN:-$target/debug/faceoff}" \
                "$target/python-version/bin/python" -m pytest --quiet -p no:cacheprovider -rs --rootdir "$here" "$here/tests"
        done
        ;;
    *)
        echo "usage: $0 wheel | test [PYTEST ARGUMENTS] | learning [PYTEST ARGUMENTS] | versions" >&2
        exit 2
        ;;
esac
