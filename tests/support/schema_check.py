#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""schema_check.py NAME FILE...: checks that documents conform to datasets/schemas/NAME.schema.json, and that the schema
detects errors: an additional key in any object, or a value of another type anywhere, must be invalid. Prints the
problems. Exit code: 1 if there are any, 2 if the check is not possible."""
import copy
import json
import sys
import warnings
from pathlib import Path

try:
    import jsonschema
except ImportError:
    sys.exit("schema_check.py: python3-jsonschema is missing: scripts/setup.sh --tests")

SCHEMAS = Path(__file__).resolve().parents[2] / "datasets/schemas"
WRONG = {"no such key": None}
ALIKE = 2  # number of elements of a list, which are alike, that are modified


def validator_of(name):
    warnings.simplefilter("ignore", DeprecationWarning)  # RefResolver, since 4.18; 4.10 has nothing else
    schema = json.loads((SCHEMAS / f"{name}.schema.json").read_text())
    kind = jsonschema.Draft202012Validator
    kind.check_schema(schema)
    return kind(schema, resolver=jsonschema.RefResolver(f"{SCHEMAS.as_uri()}/", schema))


def places(value, place=()):
    """Yields (path of keys and indices, value) for each value of a document."""
    yield place, value
    inside = value.items() if isinstance(value, dict) else []
    if isinstance(value, list):
        inside = list(enumerate(value))[:ALIKE]
    for key, item in inside:
        yield from places(item, (*place, key))


def with_wrong(document, place):
    """Returns the document with another value at a path, or, in an object, with another key."""
    wrong = copy.deepcopy(document)
    at = wrong
    for key in place[:-1]:
        at = at[key]
    there = at[place[-1]] if place else at
    if isinstance(there, dict):
        there.update(WRONG)
    elif place:
        at[place[-1]] = WRONG
    else:
        wrong = WRONG
    return wrong


def problems_of(validator, document):
    problems = [f"{error.json_path}: {error.message}" for error in validator.iter_errors(document)]
    if problems:
        return problems
    return [
        f"{'/'.join(map(str, place))}: could be anything"
        for place, _ in places(document)
        if validator.is_valid(with_wrong(document, place))
    ]


def main():
    name, *files = sys.argv[1:]
    validator = validator_of(name)
    said = [f"{file}: {words}" for file in files for words in problems_of(validator, json.loads(Path(file).read_text()))]
    print("\n".join(said), end="\n" * bool(said))
    sys.exit(1 if said or not files else 0)


if __name__ == "__main__":
    main()
