#!/usr/bin/env python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the steps of scripts/ci/action.yml in the current folder as a CI system does.

    run_action.py [INPUT=VALUE ...]

Inputs that are not given have their default. Steps that use another action (the cache) are left out. Ends with
the exit code of the first step that fails.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import yaml

ACTION = pathlib.Path(__file__).resolve().parents[2] / "scripts/ci/action.yml"


def main() -> int:
    action = yaml.safe_load(ACTION.read_text(encoding="utf-8"))
    given = dict(argument.split("=", 1) for argument in sys.argv[1:])
    inputs = {}
    for name, declared in action["inputs"].items():
        if declared.get("required") and name not in given:
            sys.exit(f"run_action.py: the input {name} is required")
        inputs[name] = given.pop(name, declared.get("default", ""))
    if given:
        sys.exit(f"run_action.py: unknown inputs: {', '.join(given)}")
    ran = 0
    outputs = tempfile.NamedTemporaryFile()
    for step in action["runs"]["steps"]:
        if "uses" in step:
            continue
        values = {
            key: re.sub(r"\$\{\{ inputs\.(\w+) \}\}", lambda match: inputs[match[1]], value)
            for key, value in step.get("env", {}).items()
        }
        unresolved = [value for value in values.values() if "${{" in value]
        if unresolved:
            sys.exit(f"run_action.py: cannot be resolved: {unresolved[0]}")
        print(f"== {step['name']}", flush=True)
        done = subprocess.run(
            [step["shell"], "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
            env={**os.environ, "GITHUB_ACTION_PATH": str(ACTION.parent), "GITHUB_OUTPUT": outputs.name, **values},
            check=False,
        )
        if done.returncode != 0:
            return done.returncode
        ran += 1
    return 0 if ran > 0 else sys.exit("run_action.py: the action has no step to run")


if __name__ == "__main__":
    sys.exit(main())
