"""Measures a small project with a fake cargo and rustc: python3 -m unittest."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import changes
import compiled_once
import elf
import report
import runs
import sources
import units

COSTS = Path(__file__).parent

# The fake cargo, the project's Makefile, and the units of cargo's report.
CARGO = """#!/bin/sh
case $1 in
build)
    mkdir -p "$CARGO_TARGET_DIR/cargo-timings" "$CARGO_TARGET_DIR/release"
    cp "$FAKES/timings.html" "$CARGO_TARGET_DIR/cargo-timings/cargo-timing.html"
    cp /bin/true "$CARGO_TARGET_DIR/release/faceoff" ;;
nextest)
    echo "   Compiling faceoff-http v0.1.0"
    echo "   Compiling faceoff-store v0.1.0"
    echo "Summary 6 tests run: 6 passed, 0 skipped" ;;
metadata)
    printf '{"packages": [{"name": "small", "manifest_path": "%s/Cargo.toml"}]}' "$PWD" ;;
tree)
    printf 'small v0.1.0 (%s)\\nrand v0.8.8\\nrand v0.10.3\\nrand v0.8.8 (*)\\n' "$PWD" ;;
*)
    exit 9 ;;
esac
"""
MAKEFILE = """CARGO ?= cargo
demo:
\t$(CARGO) build
\t@echo "1. starting the server on a folder"; sleep 0.1; echo "4. the board"; echo "5. dataset"
test: first
\t$(MAKE) --no-print-directory --jobs second third
first:
\t@sleep 1.1
second:
\t@sleep 1.2; echo second "$$MAKEFLAGS" >&2
third:
\t@test ! -e broken || (echo "a test is red"; exit 3)
"""
UNITS = [
    {"name": "large", "duration": 2.5, "sections": [["frontend", {"start": 0.0, "end": 1.0}], ["codegen", {"start": 1.0, "end": 2.5}]]},
    {"name": "small", "duration": 0.5, "sections": None},
    {"name": "large", "duration": 1.0, "sections": []},
]


def values(rows: list[dict]) -> dict[str, list[float]]:
    return {row["what"]: row["values"] for row in rows}


class Project(unittest.TestCase):
    """A repository with these scripts, and with the files that they change."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="a folder with spaces ")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.repository, self.fakes = self.folder / "repository", self.folder / "fakes"
        shutil.copytree(COSTS, self.repository / "tests/costs", ignore=shutil.ignore_patterns("__pycache__"))
        for change in (changes.PAGE, changes.TEMPLATE, changes.STORE):
            self.write(change.file, f"first\n{change.line}\nlast\n")
        self.write("Makefile", MAKEFILE)
        self.write("Cargo.toml", '[profile.dev]\nopt-level = 1\n[profile.dev.package."*"]\ndebug = false\n')
        self.write("src/lib.rs", "one\ntwo\n")
        self.write("tests/it.rs", "one\n")
        self.fakes.mkdir()
        self.script("cargo", CARGO)
        self.script("rustc", "#!/bin/sh\necho 'rustc 1.0.0 (an example)'\n")
        (self.fakes / "timings.html").write_text(f"<script>\nconst UNIT_DATA = {json.dumps(UNITS)};\nconst OTHER = [];\n</script>")
        self.git("init", "--quiet")
        self.commit()

    def write(self, name: str, text: str) -> None:
        file = self.repository / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def script(self, name: str, text: str) -> None:
        (self.fakes / name).write_text(text)
        (self.fakes / name).chmod(0o755)

    def git(self, *arguments: str) -> None:
        identity = ["-c", "user.name=test", "-c", "user.email=test@example.org", "-c", "commit.gpgsign=false"]
        subprocess.run(["git", *identity, *arguments], cwd=self.repository, check=True)

    def commit(self) -> None:
        self.git("add", "--all")
        self.git("commit", "--quiet", "--message", "test")

    def costs(self, *options: str) -> subprocess.CompletedProcess:
        path = f"{self.fakes}{os.pathsep}{os.environ['PATH']}"
        env = os.environ | {"PATH": path, "FAKES": str(self.fakes), "MAKEFLAGS": "-k --no-such-option", "CARGO_TARGET_DIR": ""}
        command = [sys.executable, "-B", self.repository / "tests/costs/costs.py", "--folder", self.folder / "work", *options]
        return subprocess.run(command, env=env, capture_output=True, text=True, timeout=600)

    def measure(self, *options: str) -> dict:
        """The JSON of a run, which must succeed."""
        done = self.costs("--json", str(self.folder / "costs.json"), *options)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(list((self.folder / "work").iterdir()), [], "clones, targets and logs are removed")
        return json.loads((self.folder / "costs.json").read_text())

    def test_all_parts_are_measured(self) -> None:
        found = self.measure()
        rows = values(found["rows"])
        board, end = rows["`make demo`, until the board is available"][0], rows["`make demo`, to its end"][0]
        self.assertGreaterEqual(board, 0.1)
        self.assertGreaterEqual(end, board)
        self.assertEqual(rows["`make test`, exit status"], [0])
        self.assertEqual(rows["release program"], [Path("/bin/true").stat().st_size])
        self.assertEqual(len(rows["a line in the store, until its test has run"]), 3)
        self.assertEqual(rows["overrides of single packages"], [1])
        self.assertEqual(rows["crates that are compiled"], [3])
        self.assertEqual(rows["crates in more than one version"], [1])
        names = ["make demo", "cargo build --release --package faceoff", "cargo build --workspace --bins --tests"]
        self.assertEqual(sorted(found["crates"]), sorted(names))
        self.assertEqual(found["lines"], [{"crate": "small", "source": 2, "tests": 1 + lines_of_changes_not_in_src()}])
        steps = {step["target"]: step for step in found["steps"]["make test"]}
        self.assertEqual(sorted(steps), ["first", "second", "test", "third"])
        self.assertGreaterEqual(steps["first"]["wall_s"], 0.1)

    def test_crates_only_measures_the_release(self) -> None:
        found = self.measure("--only", "crates")
        self.assertEqual((found["rows"], list(found["crates"])), ([], ["cargo build --release --package faceoff"]))

    def test_each_round_is_reported(self) -> None:
        rows = values(self.measure("--only", "demo", "--rounds", "2")["rows"])
        self.assertEqual(len(rows["`make demo`, to its end"]), 2)

    def test_failed_make_test_is_reported_with_its_log(self) -> None:
        self.write("broken", "")
        self.commit()
        done = self.costs("--only", "test")
        self.assertEqual(done.returncode, 1)
        self.assertIn("| `make test`, exit status | 2 |", done.stdout)
        self.assertIn("a test is red", done.stderr)
        (log,) = (self.folder / "work").glob("*/logs/test-1-1.log")
        self.assertIn(str(log), done.stderr)

    def test_failed_part_does_not_affect_others(self) -> None:
        self.script("cargo", CARGO.replace("build)", "build) echo no compiler; exit 5;;\nnever)"))
        done = self.costs("--only", "demo,lines")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no compiler", done.stderr)
        self.assertIn("overrides of single packages", done.stdout)

    def test_renamed_line_is_reported(self) -> None:
        self.write(changes.STORE.file, "something else\n")
        self.commit()
        done = self.costs("--only", "store")
        self.assertEqual(done.returncode, 1)
        self.assertIn("0 times, not once", done.stderr)

    def test_filter_without_tests_is_reported(self) -> None:
        self.script("cargo", CARGO.replace("6 passed", "0 passed"))
        self.assertIn("no test of faceoff-store is named teams::", self.costs("--only", "store").stderr)

    def test_change_that_compiles_nothing_is_reported(self) -> None:
        self.script("cargo", CARGO.replace("Compiling faceoff-store", "Fresh faceoff-store"))
        self.assertIn("faceoff-store was not compiled", self.costs("--only", "store").stderr)

    def test_unknown_part_is_refused(self) -> None:
        done = self.costs("--only", "demos")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("got demos", done.stderr)


def lines_of_changes_not_in_src() -> int:
    """The Rust files that are changed are outside of the only crate's `src`, so they count as tests."""
    return sum(3 for change in (changes.PAGE, changes.STORE) if change.file.endswith(".rs"))


class Runs(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.log = self.folder / "log"
        # A duration that no other process uses for its sleep.
        self.long_sleep_s = f"1000.{os.getpid()}"

    def run_shell(self, line: str, **options) -> runs.Run:
        return runs.run(["sh", "-c", line], self.folder, dict(os.environ), self.log, **options)

    def test_cpu_of_grandchildren_counts(self) -> None:
        busy = f"{sys.executable} -c 'import time; [None for _ in iter(lambda: time.process_time() < 0.3, False)]'"
        self.assertGreaterEqual(self.run_shell(f"{busy}; {busy}").cpu_s, 0.6)

    def test_failure_shows_the_end_of_the_log(self) -> None:
        failure = self.run_shell("seq 100; exit 7").failure()
        self.assertIn("status 7", failure)
        self.assertIn("\n    71\n", failure)
        self.assertNotIn("\n    70\n", failure)

    def test_hanging_command_is_killed_with_its_children(self) -> None:
        with self.assertRaisesRegex(runs.Failed, "did not end within"):
            self.run_shell(f"sleep {self.long_sleep_s} & wait", limit_s=0.2)
        self.assert_gone()

    def test_leftover_child_is_killed(self) -> None:
        self.run_shell(f"sleep {self.long_sleep_s} &")
        self.assert_gone()

    def assert_gone(self) -> None:
        """Asserts that the sleep is gone. A killed process may need a moment to disappear."""
        deadline = time.monotonic() + 600
        while any(f"sleep\0{self.long_sleep_s}\0".encode() == command for command in commands()):
            self.assertLess(time.monotonic(), deadline, "it is still running")
            time.sleep(0.01)


def commands() -> list[bytes]:
    """The command lines of all processes."""
    found = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            found.append(file.read_bytes())
        except OSError:
            pass
    return found


class Readers(unittest.TestCase):
    def test_units_of_a_crate_count_together(self) -> None:
        large, small = units.by_crate(units.parse(f"UNIT_DATA = {json.dumps(UNITS)};", Path("report")))
        self.assertEqual((large.name, large.units, large.total_s, large.frontend_s), ("large", 2, 3.5, 1.0))
        self.assertEqual((small.name, small.units, small.total_s), ("small", 1, 0.5))

    def test_unknown_report_of_cargo_is_reported(self) -> None:
        for text in ("<html></html>", "UNIT_DATA = [{];", 'UNIT_DATA = [{"title": "large"}];', "UNIT_DATA = 5;"):
            with self.assertRaisesRegex(runs.Failed, "another report"):
                units.parse(text, Path("report"))

    def test_sections_are_those_of_the_linker(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            source, program = Path(folder, "program.c"), Path(folder, "program")
            source.write_text("static const char text[100000] = {1};\nint main(int n, char **w) { return text[n] + w[0][0]; }\n")
            subprocess.run(["cc", "-g", "-o", program, source], check=True)
            found = elf.sections(program)
            self.assertEqual(found[0].name, ".rodata")
            self.assertGreaterEqual(found[0].bytes, 100_000)
            self.assertNotIn(".bss", [section.name for section in found])
            self.assertIn(".symtab", elf.debug_sections(found))
            self.assertIn(".debug_info", elf.debug_sections(found))
            subprocess.run(["strip", program], check=True)
            self.assertEqual(elf.debug_sections(elf.sections(program)), [])

    def test_script_has_no_sections(self) -> None:
        with self.assertRaisesRegex(runs.Failed, "no ELF program"):
            elf.sections(Path(__file__))

    def test_versions_are_those_of_the_tree(self) -> None:
        tree = "rand v0.8.8\n\nrand v0.10.3 (*)\nserde_derive v1.0.1 (proc-macro)\n[build-dependencies]\n"
        self.assertEqual(sources.versions(tree), {"rand": {"0.8.8", "0.10.3"}, "serde_derive": {"1.0.1"}})

    def test_long_steps_are_shown_without_nested_makes(self) -> None:
        def step(target: str, line: str, wall_s: float) -> runs.Step:
            return runs.Step(target, line, 5.0 + wall_s, wall_s, 0.0, 0)

        made = [step("test", "make --no-print-directory a", 90), step("a", "one \\\n  two", 90), step("b", "quick", 0.2)]
        lines = report.steps_table(made).splitlines()
        self.assertEqual(lines[2:], ["| `a` | `one two` | 90 s | 90 s | 0.0 s | 0 |"])

    def test_rows_show_the_median_and_all_rounds(self) -> None:
        row = report.Row("build", [561.2, 540.0, 552.4], "s", "")
        self.assertEqual(row.text(), "552 s (561, 540, 552)")
        self.assertEqual(report.Row("program", [39_999_999], "bytes", "").text(), "39,999,999 bytes")
        self.assertEqual(report.Row("test", [1.26], "s", "").text(), "1.3 s")


class CompiledOnce(unittest.TestCase):
    """Crates that a build of the workspace and the wheel compile more than once."""

    def library(self, name: str, file: str, *features: str) -> compiled_once.Library:
        return compiled_once.Library(f"registry+https://github.com/rust-lang/crates.io-index#{name}@1.0.0", features, file)

    def test_crate_with_two_sets_of_features_is_found(self) -> None:
        workspace = {self.library("syn", "libsyn-1.rlib", "full"), self.library("syn", "libsyn-2.rlib", "full", "fold")}
        found = compiled_once.find_repetitions(workspace, workspace)
        self.assertEqual(found, ["twice in the workspace: syn@1.0.0: fold / none of them"])

    def test_crate_that_the_wheel_compiles_again_is_found(self) -> None:
        workspace = {self.library("rapier", "librapier-1.rlib", "std")}
        wheel = {self.library("rapier", "librapier-2.rlib", "std"), self.library("pyo3", "libpyo3-1.rlib")}
        found = compiled_once.find_repetitions(workspace, wheel)
        self.assertEqual(found, ["again for the wheel: rapier@1.0.0: the same features, so a dependency differs"])

    def test_crates_that_are_compiled_once_are_not_listed(self) -> None:
        workspace = {self.library("syn", "libsyn-1.rlib", "full"), self.library("rapier", "librapier-1.rlib")}
        self.assertEqual(compiled_once.find_repetitions(workspace, {self.library("syn", "libsyn-1.rlib", "full")}), [])


if __name__ == "__main__":
    unittest.main()
