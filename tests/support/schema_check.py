#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""schema_check.py NAME FILE...: whether documents are as datasets/schemas/NAME.schema.json says, and whether the schema
would tell if they were not: with a key more in any object, or a value of another type anywhere, none is valid. Says
what is not so; exit code 1 then, 2 when it cannot tell."""
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
ALIKE = 2  # So many of a list, whose members are alike, are made wrong.


def validator_of(name):
    warnings.simplefilter("ignore", DeprecationWarning)  # RefResolver, since 4.18; 4.10 has nothing else
    schema = json.loads((SCHEMAS / f"{name}.schema.json").read_text())
    kind = jsonschema.Draft202012Validator
    kind.check_schema(schema)
    return kind(schema, resolver=jsonschema.RefResolver(f"{SCHEMAS.as_uri()}/", schema))


def places(value, place=()):
    """Of all that is in a document: (keys and numbers that lead to it, what is there)."""
    yield place, value
    inside = value.items() if isinstance(value, dict) else []
    if isinstance(value, list):
        inside = list(enumerate(value))[:ALIKE]
    for key, item in inside:
        yield from places(item, (*place, key))


def with_wrong(document, place):
    """With another value there, or, where an object is, with a key more."""
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
