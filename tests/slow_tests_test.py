#!/usr/bin/env python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""slow_tests_test.py FOLDER: fails if a pattern of slow_tests.txt matches no test of the programs below FOLDER.

Patterns of programs that are not built are not checked.
"""
import fnmatch
import pathlib
import subprocess
import sys

patterns, folder = {}, ""
for line in (pathlib.Path(__file__).parent / "slow_tests.txt").read_text().splitlines():
    if line.startswith("#"):
        folder = line[2:]
    elif line:
        patterns.setdefault(folder, []).append(line)
assert patterns, "slow_tests.txt has no patterns"

unmatched = []
for folder, names in patterns.items():
    program = pathlib.Path(sys.argv[1], folder, f"test_{folder}")
    if not program.exists():
        continue
    tests, suite = [], ""
    listed = subprocess.run([program, "--gtest_list_tests"], check=True, capture_output=True, text=True)
    for line in listed.stdout.splitlines():
        name = line.split("#")[0].rstrip()
        if name.startswith(" "):
            tests.append(suite + name.strip())
        else:
            suite = name
    unmatched += [name for name in names if not fnmatch.filter(tests, name)]
for name in unmatched:
    print(f"tests/slow_tests.txt: '{name}' matches no test; correct or remove it")
sys.exit(1 if unmatched else 0)
