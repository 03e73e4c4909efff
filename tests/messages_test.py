#!/usr/bin/env python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Checks that apps/MESSAGES.md matches the messages of the programs (scripts/messages.py), and that differences are
detected."""
import contextlib
import io
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "scripts"))
import messages  # noqa: E402

SOURCE = """void check(bool dark) {
  // [LENS-1] `too dark:` | corners not
  //   measurable | expose longer
  if (dark) throw InputError(file, "too dark: " + level + " of all");
  // [LENS-2] `the others`, `below all` | another board | remove the image
  warnings.push_back("differs from the others");
  warnings.push_back("lies far below all limits");
}
"""
REUSE = """void check_again(bool dark) {
  // [LENS-1]
  if (dark) throw InputError(file, "is too dark: all of it");
}
"""


class Tree:
    """A tree with sources and the page that belongs to them."""

    def __init__(self, root, sources):
        self.root = root
        for name in ("lib/detection", "lib/program", "apps", "scripts/reprocess"):
            (root / name).mkdir(parents=True)
        self.write("lib/detection/check.cpp", SOURCE)
        self.write("lib/program/again.cpp", REUSE)
        for name, text in sources.items():
            self.write(name, text)

    def write(self, name, text):
        (self.root / name).write_text(text)

    def run(self, *options):
        """Returns the exit code and stderr of scripts/messages.py."""
        errors, arguments, clear, first = io.StringIO(), sys.argv, messages.CLEAR, messages.FIRST_ERRORS
        sys.argv, messages.CLEAR = ["messages.py", *options, str(self.root)], []
        messages.FIRST_ERRORS = [("lies far below", "night", "wait")]
        try:
            with contextlib.redirect_stderr(errors):
                code = messages.main()
        finally:
            sys.argv, messages.CLEAR, messages.FIRST_ERRORS = arguments, clear, first
        return code, errors.getvalue()


class Messages(unittest.TestCase):
    def problems(self, sources=None, edit=None):
        """Returns stderr of --check: of a tree with a generated page, after replacing edit[0] by edit[1] in a source."""
        with tempfile.TemporaryDirectory() as folder:
            tree = Tree(Path(folder), sources or {})
            tree.run()
            if edit:
                self.assertIn(edit[0], SOURCE)
                tree.write("lib/detection/check.cpp", SOURCE.replace(*edit))
            code, errors = tree.run("--check")
            self.assertEqual(code, 1 if errors else 0)
            return errors

    def test_page_matches_sources_of_this_tree(self):
        errors, arguments = io.StringIO(), sys.argv
        sys.argv = ["messages.py", "--check", str(ROOT)]
        try:
            with contextlib.redirect_stderr(errors):
                code = messages.main()
        finally:
            sys.argv = arguments
        self.assertEqual((code, errors.getvalue()), (0, ""))

    def test_sources_of_this_tree_have_messages(self):
        found = {".cpp": 0, ".py": 0, ".sh": 0, ".h": 0}
        for file in messages.find_sources(ROOT):
            found[file.suffix] += len(messages.find_messages(file, (ROOT / file).read_text()))
        self.assertGreater(found[".cpp"], 350)
        self.assertGreater(found[".py"] + found[".sh"], 30)

    def test_page_has_parts_cause_and_remedy(self):
        with tempfile.TemporaryDirectory() as folder:
            tree = Tree(Path(folder), {})
            self.assertEqual(tree.run(), (0, ""))
            page = (tree.root / messages.PAGE).read_text()
            self.assertTrue(page.endswith(
                "\n## Board and lens\n\n| message | cause | what to do |\n|---|---|---|\n"
                "| `too dark:` | corners not measurable | expose longer |\n"
                "| `the others`, `below all` | another board | remove the image |\n"))
            self.assertEqual(tree.run("--check"), (0, ""))

    def test_detects_removed_message(self):
        edit = ('  warnings.push_back("lies far below all limits");\n', "")
        errors = self.problems(edit=edit)
        self.assertIn("check.cpp:5: LENS-2: no message below contains `below all`", errors)
        self.assertIn("FIRST_ERRORS: no message contains: lies far below", errors)

    def test_detects_changed_message(self):
        edit = ("differs from the others", "differs from all others")
        errors = self.problems(edit=edit)
        self.assertIn("LENS-2: no message below contains `the others`", errors)
        self.assertIn("states no remedy and has no annotation: differs from all others", errors)

    def test_detects_new_message(self):
        source = 'void f() { throw Error("has an odd number of ears"); }\n'
        self.assertIn("apps/new.cpp: states no remedy and has no annotation: has an odd number of ears",
                      self.problems({"apps/new.cpp": source}))
        self.assertEqual(self.problems({"apps/new.cpp": source.replace("ears", "ears: add one")}), "")

    def test_entry_explains_messages_of_annotated_files_only(self):
        source = 'void f() { throw Error("differs much from the others"); }\n'
        self.assertIn("apps/new.cpp: states no remedy", self.problems({"apps/new.cpp": source}))
        self.assertEqual(self.problems({"apps/new.cpp": "// [LENS-2]\n" + source}), "")

    def test_detects_annotation_without_message(self):
        for edit in (('throw InputError(file, "is too dark: all of it")', "return"), ("is too dark:", "is quite dim;")):
            self.assertIn("again.cpp:2: LENS-1: no message below contains a part of this entry",
                          self.problems({"lib/program/again.cpp": REUSE.replace(*edit)}))

    def test_detects_duplicate_missing_and_unknown_codes(self):
        for edit, problem in (
            (("[LENS-2]", "[LENS-1]"), "LENS-1: 2 annotations have cause and remedy"),
            (("`the others`", "`too dark:`"), "`too dark:` is annotated twice"),
            ((" | another board | remove the image", ""), "LENS-2: 0 annotations have cause and remedy"),
            ((" | remove the image", ""), "should be `part`, `part` | cause | remedy"),
            (("[LENS-2]", "[LINSE-2]"), "LINSE-2: no section has this prefix"),
        ):
            self.assertIn(problem, self.problems(edit=edit))

    def test_detects_changed_page(self):
        self.assertIn("apps/MESSAGES.md: differs from the annotations", self.problems(edit=("another board", "other board")))

    def test_remedies_are_recognized(self):
        self.assertTrue(messages.REMEDY.search("the captures span less than 90 degrees: add captures"))
        self.assertFalse(messages.REMEDY.search("the address has been changed; nothing else"))

    def test_messages_are_found_in_sources(self):
        cpp = """f("no message at all");
throw InputError(file, "lamp " + id + " is loose: "
    "fasten it");  // "not this one here"
warnings.push_back(c == '"' ? "one or two words" : "two");
"""
        self.assertEqual(messages.find_messages(Path("apps/a.cpp"), cpp),
                         ["lamp ... is loose: fasten it", "one or two words"])
        shell = 'refuse "$file: is not ${what[0]} of ours"\necho "all is well there"\n'
        self.assertEqual(messages.find_messages(Path("scripts/a.sh"), shell), ["...: is not ... of ours"])
        python = '    fail(f"{names[0]}: holds no {kind:s} here")\nsay("all is well there")\n'
        self.assertEqual(messages.find_messages(Path("scripts/a.py"), python), ["...: holds no ... here"])


if __name__ == "__main__":
    unittest.main()
