# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Prints the differences between two results of a session: reprocess.sh --diff."""
import json
import sys
from pathlib import Path

from checks import fail
from files import print_lines
from outcome import collect_remarks


def find_result(results, name):
    places = (results / place / name for place in ("sessions", "failed"))
    found = next((place for place in places if (place / "row.json").is_file()), None)
    return found or fail(f"{results}: contains no result of {name}")


def find_former_result(results, name, key):
    folder = results / "former" / name
    found = [former for former in folder.iterdir() if former.name.startswith(key)] if folder.is_dir() else []
    if not found:
        there = ", ".join(sorted(former.name for former in folder.iterdir())) if folder.is_dir() else "none"
        which = f"former result {key}" if key else "former result"
        fail(f"{results}: has no {which} of {name}; there are: {there}; --keep N sets how many are kept")
    return max(found, key=lambda former: (former / "row.json").stat().st_mtime_ns)


def load(folder):
    row = json.loads((folder / "row.json").read_text())
    file = folder / "session.json"
    empty = {"metrics": [], "steps": [], "calibration": {}, "version": ""}
    return row, empty | (json.loads(file.read_text()) if file.is_file() else {})


def collect_values(session):
    values = {f"{metric['step']} {metric['name']}": metric["value"] for metric in session["metrics"]}
    for name, value in session["calibration"].items():
        for i, one in enumerate(value if isinstance(value, list) else [value]):
            if isinstance(one, (int, float)):
                values[f"calibration {name}" + (f" {'xy'[i]}" if isinstance(value, list) else "")] = one
    return values


def words(value):
    return "none" if value is None else f"{value:.6g}"


def changed_inputs(old_row, row):
    """Names the files and folders that differ."""
    parts, old_parts = row["parts"], old_row["parts"]
    changed = sorted(part for part in {*parts, *old_parts} if parts.get(part) != old_parts.get(part))
    return ", ".join(changed) or "the same"


def list_differences(before, now):
    """Yields the lines of the comparison. Each argument is (row.json, session.json)."""
    (old_row, old), (row, new) = before, now
    yield f"verdict     {old_row['verdict']} -> {row['verdict']}" + (f": {row['reason']}" if row["reason"] else "")
    yield f"inputs      {changed_inputs(old_row, row)}"
    same = " (the same)" if old["version"] == new["version"] else ""
    yield f"version     {old['version'] or 'none'} -> {new['version'] or 'none'}{same}"
    models = (session["calibration"].get("lens_model") for session in (old, new))
    causes = [("lens model", *models), *((key, old_row.get(key), row.get(key)) for key in ("options", "toolbox"))]
    yield from (f"{key:11} {was or 'none'} -> {now or 'none'}" for key, was, now in causes if was != now)
    values, old_values = collect_values(new), collect_values(old)
    differing = [name for name in {**old_values, **values} if values.get(name) != old_values.get(name)]
    yield f"metrics     {len(differing)} of {len({**old_values, **values})} differ"
    for name in differing:
        a, b = old_values.get(name), values.get(name)
        by = f" ({b - a:+.3g})" if a is not None and b is not None else ""
        yield f"  {name}: {words(a)} -> {words(b)}{by}"
    remarks = [collect_remarks(session)["remarks"] for session in (old, new)]
    for sign, lines, others in (("-", *remarks), ("+", *reversed(remarks))):
        for line in lines:
            if line not in others:
                yield f"  {sign} {line}"


def main():
    if len(sys.argv) not in (3, 4):
        fail("--diff needs RESULTS CAMERA/SESSION and, if not the last former result, its KEY or OTHER_RESULTS")
    results, name, other = Path(sys.argv[1]), sys.argv[2].strip("/"), (sys.argv[3:] or [""])[0]
    now = find_result(results, name)
    is_folder = other and Path(other).is_dir()
    before = find_result(Path(other), name) if is_folder else find_former_result(results, name, other)
    print_lines([f"{before} -> {now}", *list_differences(load(before), load(now))])


if __name__ == "__main__":
    main()
