#!/usr/bin/env python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""language_test.py ROOT: fails if names or comments contain words that CONTRIBUTING.md excludes.

Each check has a maximum count. Lower it when a count falls; never raise it.
"""
import pathlib
import re
import sys

SOURCES = ("lib", "apps")
CHECKS = [
    # what, folders, regular expression of a line, maximum
    ("comments that begin with 'Of'", SOURCES, r"^\s*/// ?Of ", 0),
    ("comments that begin with a question word", SOURCES, r"^\s*/// ?(What|How|Where|Which|Who|Why|When|Whether) ", 0),
    ("'nothing when' for an empty result", SOURCES, r"[Nn]othing (when|where|for|if|without)\b", 0),
    ("names of bounds other than min and max", (*SOURCES, "tests"),
     r"\b(kLeast|kMost|kUsual)[A-Z]|\b(least|most|usual)_(?!squares|frequent)[a-z]\w*(?=[ ,;)({=.])", 0),
    ("speaking things in comments", SOURCES, r"//.*\b([Tt]ells?|told|nobody|worth|good for)\b", 0),
    ("'so much', 'so many' in comments", SOURCES, r"//.*\bso (much|many)\b", 0),
    ("names of tests that begin with 'Of'", ("tests",), r"^TEST(_F|_P)?\([A-Za-z]+, Of[A-Z]", 0),
    ("British spelling in names and comments", (*SOURCES, "tests"),
     r"\b\w*(?:[Cc]entre|[Cc]olour|[Mm]etres?\b|[Bb]ehaviour|[Nn]eighbour)\w*", 0),
]

root = pathlib.Path(sys.argv[1])
failed = False
for what, folders, pattern, maximum in CHECKS:
    expression = re.compile(pattern)
    found = [f"{path.relative_to(root)}:{number}: {line.strip()}"
             for folder in folders for path in sorted((root / folder).rglob("*"))
             if path.suffix in (".h", ".cpp", ".c")
             for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
             if expression.search(line)]
    print(f"{len(found):4} of at most {maximum}: {what}")
    if len(found) > maximum:
        failed = True
        print("\n".join(found))
sys.exit(1 if failed else 0)
