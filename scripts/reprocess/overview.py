# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Writes changes.json and overview.html from summary.csv, in RESULTS. Nothing in the page comes from
elsewhere, and it has no script."""
import gc
import re
import subprocess
import tempfile
from collections import Counter
from html import escape
from pathlib import Path

import fleet_page
import pictures
from changes import changes_of, check_gates, counts_of, load, name_of, read_gates, sessions_beyond_gates, with_figures
from files import json_text, read_table, write_whole
from fleet import fleet_of
from html_parts import number, picture, table

MOST_PICTURES = 6
MOST_LOOKED_INTO = 200  # sessions of other inputs, which files of them

STYLE = """body { font: 16px/1.5 sans-serif; max-width: 60rem; margin: 1rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse } td, th { text-align: left; padding: 0.2rem 0.8rem; border-bottom: 1px solid #ccc }
.wide { overflow-x: auto } img { max-width: 100% } .verdict { font-size: 2rem; font-weight: bold }"""


def compared(run, truth, now, before):
    """The verdict of vlp-evaluate on the captures of one session."""
    with tempfile.TemporaryDirectory() as folder:
        command = [run["bin"] + "/vlp-evaluate", now, "--truth", truth, "--compare", before]
        command += ["--threads", "1", "--json", folder + "/evaluation.json"]
        if subprocess.run(command, capture_output=True, check=False).returncode != 0:
            return "cannot be compared"
        return load(Path(folder) / "evaluation.json")["comparison"]["verdict"]


def reasons(rows):
    """How often sessions have no result for the same reason, their names left out."""
    said = Counter(re.sub(re.escape(name_of(row)) + "/?", "", row["reason"]) for row in rows)
    return sorted(said.items(), key=lambda item: (-item[1], item[0]))


def differing(run, previous, pairs):
    html = "<h2>Sessions that differ most</h2>\n"
    rows = []
    for row, old, change in pairs[:MOST_PICTURES]:
        files = [Path(run["archive"]) / name_of(row) / "check/truth.csv", Path("sessions") / name_of(row) / "fixes.csv"]
        files.append(previous / "sessions" / name_of(row) / "fixes.csv")
        verdict = compared(run, *files) if all(file.exists() for file in files) else "fixes are missing"
        rows.append((name_of(row), old["mean_mm"], row["mean_mm"], f"{change:+.4g}", verdict))
    html += table(["session", "before (mm)", "now (mm)", "change (mm)", "vlp-evaluate"], rows)
    for row, _, change in pairs[:MOST_PICTURES]:
        truth = Path(run["archive"]) / name_of(row) / "check/truth.csv"
        fixes = [folder / "sessions" / name_of(row) / "fixes.csv" for folder in (previous, Path("."))]
        if change == 0 or not all(file.exists() for file in [truth, *fixes]):
            continue
        data, scale = pictures.floor(truth, *fixes)
        if data:
            html += picture(data, f"{name_of(row)}: errors over the floor, before and now, {scale} times as large")
    return html


def parts_of(results, name):
    """Digests of what is in a session's folder, as it was run there."""
    for place in ("sessions", "failed"):
        file = results / place / name / "row.json"
        if file.exists():
            return load(file).get("parts", {})
    return {}


def changed_inputs(previous, rows, changes):
    html = "<h2>Of other inputs than before</h2>\n"
    by_name, listed = {name_of(row): row for row in rows}, []
    lost = changes["lost_with_other_inputs"]
    for name in [*lost, *(name for name in changes["with_other_inputs"] if name not in set(lost))][:MOST_LOOKED_INTO]:
        now, before = parts_of(Path("."), name), parts_of(previous, name)
        files = sorted(part for part in {*now, *before} if now.get(part) != before.get(part))
        what = "lost its result" if name in lost else by_name[name]["verdict"]
        listed.append((name, ", ".join(files) if before else "not known", what))
    html += table(["session", "what of it is another", "now"], listed)
    more = changes["other_inputs"] - len(listed)
    return html + (f"<p>and {more} more, in changes.json</p>\n" if more else "")


def comparison(run, previous, rows, before, changes, pairs):
    html = "<h2>What changed</h2>\n"
    html += table(
        ["", "sessions"],
        [(words, len(changes[key]) if isinstance(changes[key], list) else changes[key]) for words, key in COUNTED],
    )
    if pairs:
        html += f"<p>Mean change: {number(changes['mean_difference_mm'])} mm"
        if "interval_95_mm" in changes:
            low, high = changes["interval_95_mm"]
            html += f", 95 % interval {low:.4g} to {high:.4g} mm"
        html += f": <strong>{escape(changes['verdict'])}</strong></p>\n"
        figures = [(float(old["mean_mm"]), float(row["mean_mm"])) for row, old, _ in pairs]
        html += picture(pictures.scatter(sorted(figures)), "Mean error of each session, before and now")
        html += differing(run, previous, pairs)
    if changes["other_inputs"]:
        html += changed_inputs(previous, rows, changes)
    if changes["newly_failed"]:
        html += "<h2>Had a result before, and have none now</h2>\n"
        by_name = {name_of(row): row["reason"] for row in rows}
        html += table(["session", "reason"], [(name, by_name[name]) for name in changes["newly_failed"]])
    return html


COUNTED = [
    ("better", "better"),
    ("worse", "worse"),
    ("the same", "same"),
    ("without a result, had one", "newly_failed"),
    ("with a result, had none", "newly_good"),
    ("of other inputs than before", "other_inputs"),
    ("of them without a result, had one", "lost_with_other_inputs"),
    ("new", "only_now"),
    ("no longer there", "only_before"),
]


def look_here(rows):
    look = [row for row in rows if row["verdict"] == "look"]
    if not look:
        return ""
    words = "<h2>Passed, but look here</h2>\n"
    columns = ["session", "mean (mm)", "images skipped", "lamps left out (captures)", "what to look at"]
    keys = ("mean_mm", "images_skipped", "lamps_left_out", "look")
    return words + table(columns, [(name_of(row), *(row[key] for key in keys)) for row in look])


def page(run, rows, counts, gates, fleet, parts):
    missed = [gate for gate in gates if not gate["passed"]]
    beyond = sessions_beyond_gates(counts, gates)
    html = '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
    html += '<meta name="viewport" content="width=device-width, initial-scale=1">'
    html += f"<title>Reprocessed archive</title><style>{STYLE}</style></head><body><main>\n<h1>Reprocessed archive</h1>\n"
    if gates or beyond:
        html += f'<p class="verdict">{"FAIL" if missed or beyond else "PASS"}</p>\n'
    if beyond:
        html += f"<p>{beyond} of {counts['sessions']} sessions miss a gate of theirs.</p>\n"
    html += look_here(rows) + fleet
    if gates:
        html += "<h2>Gates</h2>\n"
        words = [(g["name"], number(g["value"]), g["limit"], "met" if g["passed"] else "not met") for g in gates]
        html += table(["gate", "value", "at most", ""], words)
    html += f"<p>Version {escape(run['version'])}, toolbox {run['toolbox'][:12]}.</p>\n<h2>Sessions</h2>\n"
    html += table(["figure", "value"], [(name.replace("_", " "), number(value)) for name, value in counts.items()])
    failed = [row for row in rows if row["verdict"] in ("no result", "crashed")]
    if failed:
        html += "<h2>Without a result</h2>\n" + table(["reason", "sessions"], reasons(failed))
        html += table(["session", "reason"], [(name_of(row), row["reason"]) for row in failed])
    missing = [row for row in rows if row["verdict"] == "gate"]
    if missing:
        html += "<h2>A gate is not met</h2>\n"
        html += table(["session", "mean (mm)", "reason"], [(name_of(r), r["mean_mm"], r["reason"]) for r in missing])
    return html + parts + "</main></body></html>\n"


def main():
    run, compare = load(Path(".state/run.json")), load(Path(".state/compare.json"))
    rows = read_table("summary.csv")
    before = read_table(Path(compare["previous"]) / "summary.csv") if compare["previous"] else []
    counts = counts_of(rows)
    changes, pairs = changes_of(rows, before) if compare["previous"] else (None, [])
    gates = read_gates(Path(compare["gates"])) if compare["gates"] else {}
    results = check_gates(gates, counts, changes)
    parts = ""
    figures = [[float(row["mean_mm"]) for row in with_figures(some)] for some in (rows, before)]
    if figures[0]:
        parts += "<h2>Errors</h2>\n" + picture(pictures.distribution(*figures), "Mean errors of the sessions")
    if changes:
        parts += comparison(run, Path(compare["previous"]), rows, before, changes, pairs)
    passed = all(gate["passed"] for gate in results) and not sessions_beyond_gates(counts, results)
    fleet_rows, lamp_rows = read_table("fleet.csv"), read_table("lamps.csv")
    fleet = fleet_of(fleet_rows, lamp_rows)
    document = {"counts": counts, "changes": changes, "gates": results, "passed": passed, "fleet": fleet}
    write_whole("changes.json", json_text({"format": "vlp-archive-changes/1", **document}))
    write_whole("overview.html", page(run, rows, counts, results, fleet_page.page(fleet, fleet_rows, lamp_rows), parts))


if __name__ == "__main__":
    gc.disable()  # of an archive's many rows none go in circles
    main()
