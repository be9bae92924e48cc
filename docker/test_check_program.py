"""Tests check-program.sh with programs that have one defect each: python3 -m unittest.

The programs are small C programs with the output of the release program.
"""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

CHECK = Path(__file__).with_name("check-program.sh")
GOLDEN = Path(__file__).parents[1] / "tests/golden/simulator.txt"
# The limit in check-program.sh.
MOST_BYTES = 40_000_000


class Programs(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory(prefix="a folder with spaces ")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def program(self, prints: str, *options: str) -> Path:
        """A program that prints this text for `sim golden`, and fails for other arguments."""
        hashes, source, program = (self.folder / name for name in ("hashes", "program.c", "program"))
        hashes.write_text(prints)
        source.write_text(
            "#include <string.h>\n#include <unistd.h>\n"
            "int main(int count, char **words) {\n"
            '    if (count != 3 || strcmp(words[1], "sim") || strcmp(words[2], "golden")) return 2;\n'
            f'    return execlp("cat", "cat", "{hashes}", (char *)0);\n'
            "}\n"
        )
        subprocess.run(["cc", *options, "-o", program, source], check=True)
        return program

    def judge(self, program: Path) -> tuple[int, str, str]:
        done = subprocess.run([CHECK, program], capture_output=True, text=True, timeout=600)
        return done.returncode, done.stdout, done.stderr

    def assert_refused(self, program: Path, *words: str) -> None:
        code, out, error = self.judge(program)
        self.assertEqual((code, out), (1, ""), error)
        for word in words:
            self.assertIn(word, error)

    def test_program_without_defects_passes(self) -> None:
        code, out, error = self.judge(self.program(GOLDEN.read_text(), "-s"))
        self.assertEqual((code, error), (0, ""), out)

    def test_program_of_the_largest_size_passes(self) -> None:
        program = self.program(GOLDEN.read_text(), "-s")
        os.truncate(program, MOST_BYTES)
        self.assertEqual(self.judge(program)[0], 0)

    def test_larger_program_is_refused(self) -> None:
        program = self.program(GOLDEN.read_text(), "-s")
        os.truncate(program, MOST_BYTES + 1)
        self.assert_refused(program, f"has {MOST_BYTES + 1} bytes", "make costs")

    def test_symbol_table_is_refused(self) -> None:
        self.assert_refused(self.program(GOLDEN.read_text()), ".symtab", 'strip = "symbols"')

    def test_debug_sections_are_refused(self) -> None:
        program = self.program(GOLDEN.read_text(), "-g")
        self.assert_refused(program, ".symtab", ".debug_info", ".debug_line")

    def test_other_hash_is_refused_and_shown(self) -> None:
        first = GOLDEN.read_text().splitlines()[0]
        other = first[:-1] + ("0" if first[-1] != "0" else "1")
        program = self.program(GOLDEN.read_text().replace(first, other), "-s")
        self.assert_refused(program, f"< {first}", f"> {other}", "needs a new ruleset")

    def test_missing_hash_is_refused(self) -> None:
        all_but_one = "".join(GOLDEN.read_text().splitlines(keepends=True)[:-1])
        self.assert_refused(self.program(all_but_one, "-s"), "computes other golden hashes")

    def test_every_defect_is_named(self) -> None:
        program = self.program("", "-g")
        os.truncate(program, MOST_BYTES + 1)
        self.assert_refused(program, ".symtab", "bytes", "golden hashes")

    def test_failing_program_is_refused(self) -> None:
        (self.folder / "empty.c").write_text("int main(void) { return 3; }\n")
        program = self.folder / "fails"
        subprocess.run(["cc", "-s", "-o", program, self.folder / "empty.c"], check=True)
        self.assert_refused(program, "does not run `faceoff sim golden`")

    def test_script_is_no_program(self) -> None:
        self.assert_refused(CHECK, "is no ELF program")


if __name__ == "__main__":
    unittest.main()
