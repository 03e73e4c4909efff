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
MAX_ELEMENTS = 2  # elements of a list that are modified; the others have the same schema


def make_validator(name):
    warnings.simplefilter("ignore", DeprecationWarning)  # RefResolver is deprecated since 4.18; 4.10 has no alternative
    schema = json.loads((SCHEMAS / f"{name}.schema.json").read_text())
    kind = jsonschema.Draft202012Validator
    kind.check_schema(schema)
    return kind(schema, resolver=jsonschema.RefResolver(f"{SCHEMAS.as_uri()}/", schema))


def list_paths(value, path=()):
    """Yields (path of keys and indices, value) for each value of a document."""
    yield path, value
    inside = value.items() if isinstance(value, dict) else []
    if isinstance(value, list):
        inside = list(enumerate(value))[:MAX_ELEMENTS]
    for key, item in inside:
        yield from list_paths(item, (*path, key))


def insert_error(document, path):
    """Returns the document with another value at a path, or, in an object, with another key."""
    wrong = copy.deepcopy(document)
    at = wrong
    for key in path[:-1]:
        at = at[key]
    value = at[path[-1]] if path else at
    if isinstance(value, dict):
        value.update(WRONG)
    elif path:
        at[path[-1]] = WRONG
    else:
        wrong = WRONG
    return wrong


def find_problems(validator, document):
    problems = [f"{error.json_path}: {error.message}" for error in validator.iter_errors(document)]
    if problems:
        return problems
    return [
        f"{'/'.join(map(str, place))}: could be anything"
        for place, _ in list_paths(document)
        if validator.is_valid(insert_error(document, place))
    ]


def main():
    name, *files = sys.argv[1:]
    validator = make_validator(name)
    said = [f"{file}: {words}" for file in files for words in find_problems(validator, json.loads(Path(file).read_text()))]
    print("\n".join(said), end="\n" * bool(said))
    sys.exit(1 if said or not files else 0)


if __name__ == "__main__":
    main()
