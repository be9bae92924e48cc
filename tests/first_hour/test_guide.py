#!/usr/bin/env python3
"""Tests how commands are read from a page and outputs are compared: python3 test_guide.py."""

import tempfile
import unittest
from pathlib import Path

import guide

PAGE = """# Guide
## First
```console
$ faceoff new agent
agent: an agent

  cd agent
$ cd agent
```
```sh
not run
```
### Still first
```console
$ faceoff eval .
```
## Second
```console
$ rm -rf .
```
"""


class Commands(unittest.TestCase):
    def test_console_blocks_of_a_section_are_commands_with_output(self):
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder, "page.md")
            page.write_text(PAGE)
            found = guide.commands(page, "## First")
        self.assertEqual([command.text for command in found], ["faceoff new agent", "cd agent", "faceoff eval ."])
        self.assertEqual(found[0].output, ["agent: an agent", "", "  cd agent"])
        self.assertEqual((found[0].line, found[1].output), (4, []))


class Difference(unittest.TestCase):
    def assert_same(self, expected: str, output: str):
        self.assertIsNone(guide.difference(expected.splitlines(), output))

    def assert_different(self, expected: str, output: str):
        self.assertIsNotNone(guide.difference(expected.splitlines(), output))

    def test_results_are_compared_and_times_are_not(self):
        row = "defend   100   {} %   59.4 to 77.2 %   {} {}   0    0    0    0    {}     {} / 10.40 / 11.00"
        first = row.format("69.0", "0.0", "Deployable", "0", "3.05")
        self.assert_same(first, row.format("69.0", "14.0", "Improvable", "23", "0.75"))
        self.assert_different(first, row.format("68.0", "0.0", "Deployable", "0", "3.05"))

    def test_penalty_points_of_an_episode_are_not_compared(self):
        self.assert_same("defend   8   124 stopped   no   0", "defend   8   124 stopped   no   0.5")
        self.assert_different("defend   8   124 stopped   no   0", "defend   8   124 stopped   yes   0")

    def test_missing_and_further_lines_are_differences(self):
        self.assert_same("a\nb", "a\nb\n")
        self.assert_different("a\nb", "a\n")
        self.assert_different("a\nb", "a\nnew\nb\n")
        self.assert_different("a", "a\nb\n")
        self.assert_different("a\nb", "b\na\n")

    def test_ellipsis_stands_for_any_lines_or_text(self):
        self.assert_same("…\nb", "a\na\nb\n")
        self.assert_same("a\n…", "a\nb\n")
        self.assert_same("a\n…", "a\n")
        self.assert_same("missing: …; done", "missing: memory, cpu; done\n")
        self.assert_different("…\nb", "a\n")

    def test_output_is_not_compared_if_the_page_shows_none(self):
        self.assert_same("", "anything\n")


if __name__ == "__main__":
    unittest.main()
