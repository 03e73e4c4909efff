#!/usr/bin/env python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Changes the code of a folder of lib/ in small ways and reports which changes its tests do not notice.

    scripts/mutate.py FOLDER [--count N] [--seed S] [--jobs N] [--preset P] [--quick]

Each mutant changes one operator, constant, sign, statement or pair of arguments. It is compiled to an object of its own
and linked before the folder's library, or to a library that the tests load in place of the one in lib/codecs; neither
the sources nor the build folder change. Mutants that do not compile are replaced by others. A mutant is detected if a
test of tests/FOLDER fails or crashes, or if the tests take three times the processor time. Quick tests run first, the
slow ones of tests/slow_tests.txt last, and with --quick never. Prints each survivor as FILE:LINE with both lines, then
the score. Exit code 0; 1 if the tests are missing or fail without a mutant; 2 for bad usage.

Changes that rarely have an effect are not made:
- < to <= and the like between floating-point values, which are equal with probability zero (see COUNTS)
- 1.5 times a constant with a negative exponent: tolerances and steps of difference quotients have that latitude
- one more iteration, one more element of an array, no reserve()

Build the tests first: PRESET=dev scripts/test.sh FOLDER.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import random
import re
import resource
import shlex
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SKIPPED = re.compile(r'R"(\w*)\((?:.|\n)*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*(?:.|\n)*?\*/'
                     r"|^[ \t]*#[^\n]*|\bstatic_assert\b[^;]*;|\btemplate\s*<[^;{]*?>\s*(?=\w)", re.M)
OPERATORS = {" + ": [" - "], " - ": [" + "], " * ": [" / "], " / ": [" * "], " < ": [" <= ", " > "], " > ": [" >= ", " < "],
             " <= ": [" < ", " >= "], " >= ": [" > ", " <= "], " == ": [" != "], " != ": [" == "], " && ": [" || "],
             " || ": [" && "], " += ": [" -= "], " -= ": [" += "], " *= ": [" /= "], "++": ["--"], "std::min(": ["std::max("],
             "std::max(": ["std::min("], "true": ["false"], "false": ["true"], "std::sin(": ["std::cos("],
             "std::cos(": ["std::sin("], "transpose()": ["eval()"]}
NUMBER = re.compile(r"(?<![\w.])(?:\d+\.?\d*(?:e[+-]?\d+)?)(?![\w.])")
STATEMENT = re.compile(r"^[ \t]*(?!return\b|const\b|using\b|auto\b|break\b|case\b|throw\b|[\w:<>, ]+ \w+(?: =|;|\{|\())"
                       r"[\w\[\]().>:*-]+(?:\([^;{}]*\)| [-+*/]?= [^;{}]*);[ \t]*$", re.M)
# The order of the arguments of these functions has no effect.
ARGUMENTS = re.compile(r"\b(?!(?:min|max|hypot|swap)\()[a-z]\w*\(([\w.]+), ([\w.]+)\)")
MINUS = re.compile(r"(?<=[(=,] )-(?=[a-z(])|(?<=\()-(?=[a-z(])|(?<=return )-(?=[a-z(])")
# Lines that compare integers: only these, unless LATITUDE matches, get < for <=.
COUNTS = re.compile(r"\+\+|size|count|rows\(\)|cols\(\)|\bnum_|\bn\b|\b(?:width|height)\b|static_cast<(?:int|std::)")
# Constants and limits that may increase by one without effect.
LATITUDE = re.compile(r"\bmax_(?:num_)?(?:iterations|halvings|steps|rounds)\b|std::array<[^<>;]*$")
CONDITION = re.compile(r"\bif \((?=[^;{}]*\))")


def is_boundary(old, new):
    """Returns true if the change only affects equal values: < for <=, >= for > and the like."""
    return old.strip().rstrip("=") == new.strip().rstrip("=") and old.strip()[0] in "<>"


def find_mutations(text):
    """Returns (begin, end, replacement) for each change outside comments, literals and preprocessor lines."""
    masked = SKIPPED.sub(lambda m: re.sub(r"[^\n]", "\0", m[0]), text)
    found = []
    for old, news in OPERATORS.items():
        for match in re.finditer((r"\b" if old[0].isalpha() else "") + re.escape(old), masked):
            if re.search(r"template|operator", masked[masked.rfind("\n", 0, match.start()) + 1:match.start()]):
                continue
            line = masked[masked.rfind("\n", 0, match.start()) + 1:masked.find("\n", match.end())]
            counts = COUNTS.search(line) and not LATITUDE.search(line)
            found += [(match.start(), match.end(), new) for new in news if counts or not is_boundary(old, new)]
    for match in NUMBER.finditer(masked):
        value = match[0]
        if "e-" in value or LATITUDE.search(masked[masked.rfind("\n", 0, match.start()) + 1:match.start()]):
            continue
        found.append((match.start(), match.end(), str(int(value) + 1) if value.isdigit() else f"(1.5 * {value})"))
    for match in STATEMENT.finditer(masked):
        found.append((match.start(), match.end(), ""))
    for match in ARGUMENTS.finditer(masked):
        if match[1] != match[2]:
            found.append((match.start(1), match.end(2), f"{match[2]}, {match[1]}"))
    for match in MINUS.finditer(masked):
        found.append((match.start(), match.end(), ""))
    for match in CONDITION.finditer(masked):
        end, depth = match.end(), 1
        while depth:
            depth += {"(": 1, ")": -1}.get(masked[end], 0)
            end += 1
        condition = text[match.end():end - 1]
        if ";" not in condition and " = " not in condition:
            found.append((match.end(), end - 1, f"!({condition})"))
    return [(begin, end, new) for begin, end, new in found
            if ".reserve(" not in text[text.rfind("\n", 0, begin) + 1:text.find("\n", end)]]


MEMORY_KIB = 4 << 20  # limit for mutants that allocate without end


class Folder:
    """Commands that compile, link and run the tests of a folder."""

    def __init__(self, name, preset, quick):
        self.build = ROOT / ("build" if preset == "release" else f"build-{preset}")
        self.test = self.build / "tests" / name / f"test_{name}"
        if not self.test.exists():
            sys.exit(f"mutate.py: {self.test} is missing; build it: PRESET={preset} scripts/test.sh {name}")
        commands = json.loads((self.build / "compile_commands.json").read_text())
        self.compile = {pathlib.Path(c["file"]): c["command"] for c in commands
                        if pathlib.Path(c["file"]).is_relative_to(ROOT / "lib" / name) and c["file"].endswith(".cpp")}
        if not self.compile:
            sys.exit(f"mutate.py: no source of lib/{name} is compiled alone; use a preset without unity builds (dev)")
        self.link = self.find_link_command(f"tests/{name}/test_{name}")
        # Objects of libraries that the tests load, and how these are linked.
        self.modules = {}
        for file, command in self.compile.items():
            target_object = re.search(r" -o (\S+/CMakeFiles/([^/]+)\.dir/\S+) -c ", command)
            module = f"lib/codecs/lib{target_object[2]}.so"
            if (self.build / module).exists():
                self.modules[file] = (target_object[1], self.find_link_command(module))
        slow = (ROOT / "tests/slow_tests.txt").read_text().split("\n")
        self.slow = ":".join(line for line in slow if line and not line.startswith("#"))
        self.quick = quick

    def find_link_command(self, target):
        """Returns the command that links a target up to its output, and the rest."""
        commands = subprocess.run(["ninja", "-C", str(self.build), "-t", "commands", target],
                                  check=True, capture_output=True, text=True).stdout
        return re.search(r"&& (\S*\+\+ .*? -o \S+)(.*?)(?: && |$)", commands.rstrip().split("\n")[-1]).groups()

    def run(self, program, pattern, limit_s, *options):
        """Returns true if the tests pass within a limit of processor time. They load libraries beside the program."""
        limits = f"ulimit -v {MEMORY_KIB}; ulimit -t {limit_s}"
        with tempfile.TemporaryDirectory() as scratch:
            try:
                done = subprocess.run(["sh", "-c", limits + '; exec "$0" "$@"', program, "--gtest_brief=1",
                                       "--gtest_fail_fast", f"--gtest_filter={pattern}", *options],
                                      cwd=scratch, env=os.environ | {"LD_LIBRARY_PATH": str(program.parent)},
                                      capture_output=True, timeout=20 * limit_s, check=False)
            except subprocess.TimeoutExpired:
                return False
        return done.returncode == 0

    def passes(self, program, stages):
        return all(self.run(program, pattern, limit_s) for pattern, limit_s in stages)

    def measure(self):
        """Returns the stages of the tests, each with a limit of processor time in seconds: the quick tests, those that
        take longer than a fifth of a second, and the slow ones. Exits if a test fails.
        """
        def measure_s(pattern, *options):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            if not self.run(self.test, pattern, 3600, *options):
                sys.exit("mutate.py: the tests fail without a mutant")
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

        with tempfile.TemporaryDirectory() as scratch:
            output = pathlib.Path(scratch, "times.json")
            spent_s = measure_s("-" + self.slow, f"--gtest_output=json:{output}")
            suites = json.loads(output.read_text())["testsuites"]
        times_s = {f"{suite['name']}.{test['name']}": float(test["time"].rstrip("s"))
                   for suite in suites for test in suite["testsuite"]}
        longer = [name for name, time_s in times_s.items() if time_s > 0.2]
        quick_s = sum(time_s for time_s in times_s.values() if time_s <= 0.2)
        stages = [("-" + ":".join([*longer, self.slow]), int(3 * min(quick_s, spent_s)) + 10)]
        if longer:
            stages.append((":".join(longer), int(3 * spent_s) + 10))
        if self.slow and not self.quick:
            stages.append((self.slow, int(3 * measure_s(self.slow)) + 10))
        return stages

    def judge(self, file, text, stages):
        """Returns whether the tests pass; None if the text does not compile."""
        with tempfile.TemporaryDirectory() as scratch:
            source, mutant = pathlib.Path(scratch, file.name), pathlib.Path(scratch, "mutant.o")
            source.write_text(text)
            command = re.sub(r" -o \S+ -c \S+$", f" -o {mutant} -c {source}", self.compile[file])
            command = command.replace(" -Werror", "") + f" -w -g0 -iquote {file.parent}"
            if subprocess.run(shlex.split(command), cwd=self.build, capture_output=True, check=False).returncode:
                return None
            program = pathlib.Path(scratch, "test")
            if file in self.modules:
                target_object, (head, tail) = self.modules[file]
                output = head.rsplit("/", maxsplit=1)[1]
                link = re.sub(r" -o \S+$", f" -o {pathlib.Path(scratch, output)}", head) + tail.replace(
                    target_object, str(mutant))
                program.symlink_to(self.test)
            else:
                head, tail = self.link
                link = re.sub(r" -o \S+$", f" {mutant} -o {program}", head) + tail
            if subprocess.run(link, shell=True, cwd=self.build, capture_output=True, check=False).returncode:
                return None
            return self.passes(program, stages)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("folder")
    parser.add_argument("--count", type=int, default=75, help="mutants that compile (75)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--preset", default="dev")
    parser.add_argument("--quick", action="store_true", help="without the tests of tests/slow_tests.txt")
    options = parser.parse_args()
    folder = Folder(options.folder, options.preset, options.quick)
    stages = folder.measure()
    draw = random.Random(options.seed)
    texts = {file: file.read_text() for file in sorted(folder.compile)}
    sites = [(file, *place) for file, text in texts.items() for place in find_mutations(text)]
    draw.shuffle(sites)
    judged = survived = 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        def judge(site):
            file, begin, end, new = site
            text = texts[file]
            return site, folder.judge(file, text[:begin] + new + text[end:], stages)

        while judged < options.count and sites:
            batch = [sites.pop() for _ in range(min(len(sites), options.count - judged))]
            for (file, begin, end, new), passed in pool.map(judge, batch):
                if passed is None:
                    continue
                judged += 1
                if not passed:
                    continue
                survived += 1
                text = texts[file]
                line = text.count("\n", 0, begin) + 1
                first, last = text.rfind("\n", 0, begin) + 1, text.find("\n", end)
                print(f"{file.relative_to(ROOT)}:{line}: {text[first:last].strip()}\n"
                      f"    {(text[first:begin] + new + text[end:last]).strip() or '(removed)'}", flush=True)
    if not judged:
        sys.exit("mutate.py: no mutant compiled")
    print(f"{judged - survived} of {judged} mutants detected ({100 * (judged - survived) / judged:.0f} %)")


if __name__ == "__main__":
    main()
