#!/usr/bin/env python3
"""The check of words finds what is planted, and nothing else."""

import subprocess
import tempfile
import unittest
from pathlib import Path

import words

LIST = words.Words(words.HERE / "words.toml")


def found(file: str, text: str) -> list[str]:
    return [finding.found for finding in LIST.check(file, text)]


class Check(unittest.TestCase):
    def test_phrase_is_found_in_every_kind_of_file(self):
        for file in ("a.rs", "web/b.html", "docs/c.md", "d.py", "e.sh"):
            self.assertEqual(found(file, "An expired link is worth nothing."), ["worth nothing"])
            self.assertEqual(found(file, "An expired link is refused."), [])

    def test_ordinary_words_stay(self):
        self.assertEqual(found("a.rs", "// Keys in order; the work of a turn.\nfn order(key: Work) {}"), [])

    def test_private_names_of_types_and_modules_are_found(self):
        self.assertEqual(found("a.rs", "pub(crate) struct Standing {\npub enum Rank {"), ["Standing"])
        self.assertEqual(found("src/told.rs", "pub struct Summary;"), ["told"])
        self.assertEqual(found("src/summary.rs", "pub struct Summary;"), [])

    def test_comment_that_says_nothing_is_found(self):
        self.assertEqual(found("a.rs", "    /// Likewise.\n    /// Likewise in metres.\n"), ["Likewise."])

    def test_name_of_a_test_is_its_subject_and_short(self):
        long = "link_" + "x" * 60
        rust = f"#[test]\nfn what_expires() {{}}\n#[tokio::test]\nasync fn {long}() {{}}\nfn what_helps() {{}}\n"
        self.assertEqual(found("a.rs", rust), ["what_expires", long])
        self.assertEqual(found("test_a.py", "def test_of_links():\ndef of_links():\n"), ["of_links"])

    def test_exception_is_for_one_place_and_needed(self):
        listed = words.Words(words.HERE / "words.toml")
        listed.exceptions = [{"file": "docs/a.md", "text": "anew, he wrote", "reason": "a quotation"}]
        quoted = list(listed.check("docs/a.md", "Begin anew, he wrote.\nBegin anew.\n"))
        self.assertEqual([finding.line for finding in listed.remaining(quoted)], [2])
        self.assertIn("nothing needs", str(listed.remaining([])[0]))

    def test_planted_word_fails_the_command(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["git", "init", "-q", folder], check=True)
            Path(folder, "a.md").write_text("Begin anew.\n")
            planted = subprocess.run(["python3", words.__file__, folder], capture_output=True, text=True)
            self.assertIn("a.md:1: anew", planted.stdout)
            self.assertEqual(planted.returncode, 1)


if __name__ == "__main__":
    unittest.main()
