# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Writes changes.json and overview.html from summary.csv, in RESULTS. Nothing in the page comes from
elsewhere, and it has no script."""
import gc
import subprocess
import tempfile
from html import escape
from pathlib import Path

import fleet_page
import pictures
from changes import (
    DEFAULT_GATES,
    HAVE_RESULT,
    changes_of,
    check_gates,
    count_reasons,
    counts_of,
    is_incomplete,
    listed_items,
    load,
    lost_results,
    name_of,
    read_gates,
    sessions_beyond_gates,
    vanished_sessions,
    with_figures,
)
from files import json_text, read_table, write_whole
from fleet import fleet_of
from html_parts import number, picture, table

MAX_NAMES = 5  # in a line of the list of actions
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
            html += picture(data, f"{name_of(row)}: errors over the floor, before and now, magnified {scale} times")
    return html


def parts_of(results, name):
    """Digests of what is in a session's folder, as it was run there."""
    for place in ("sessions", "failed"):
        file = results / place / name / "row.json"
        if file.exists():
            return load(file).get("parts", {})
    return {}


def changed_inputs(previous, rows, before, changes):
    html = "<h2>Sessions with changed inputs</h2>\n"
    by_name, listed = {name_of(row): row for row in rows}, []
    rows_before = {name_of(row): row for row in before}
    lost = changes["lost_with_other_inputs"]
    for name in [*lost, *(name for name in changes["with_other_inputs"] if name not in set(lost))][:MOST_LOOKED_INTO]:
        parts_now, parts_before = parts_of(Path("."), name), parts_of(previous, name)
        files = sorted(part for part in {*parts_now, *parts_before} if parts_now.get(part) != parts_before.get(part))
        what = "lost its result" if name in lost else by_name[name]["verdict"]
        figures = [one.get(key, "") for key in COMPARED for one in (rows_before[name], by_name[name])]
        listed.append((name, ", ".join(files) if parts_before else "not known", what, *figures))
    columns = [f"{key.replace('_', ' ')} {when}" for key in COMPARED for when in ("before", "now")]
    html += table(["session", "changed inputs", "now", *columns], listed)
    more = changes["other_inputs"] - len(listed)
    return html + (f"<p>and {more} more, in changes.json</p>\n" if more else "")


def comparison(run, previous, rows, before, changes, pairs):
    html = "<h2>Comparison with earlier results</h2>\n"
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
        html += changed_inputs(previous, rows, before, changes)
    if changes["newly_failed"]:
        html += "<h2>Newly without a result</h2>\n"
        by_name = {name_of(row): row["reason"] for row in rows}
        html += table(["session", "reason"], [(name, by_name[name]) for name in changes["newly_failed"]])
    return html


COMPARED = ("verdict", "mean_mm", "rms_px")  # before and now, where inputs changed

COUNTED = [
    ("better", "better"),
    ("worse", "worse"),
    ("the same", "same"),
    ("newly without a result", "newly_failed"),
    ("newly with a result", "newly_good"),
    ("with changed inputs", "other_inputs"),
    ("with changed inputs, newly without a result", "lost_with_other_inputs"),
    ("new", "only_now"),
    ("no longer in the archive", "only_before"),
]


def look_here(rows):
    look = [row for row in rows if row["verdict"] == "look"]
    if not look:
        return ""
    words = '<h2 id="look">Passed with remarks</h2>\n'
    columns = ["session", "mean (mm)", "images skipped", "rejected lamps (captures)", "remarks"]
    keys = ("mean_mm", "images_skipped", "rejected_lamps", "remarks")
    return words + table(columns, [(name_of(row), *(row[key] for key in keys)) for row in look])


def shorten(items):
    more = f" and {len(items) - MAX_NAMES} more" if len(items) > MAX_NAMES else ""
    return "; ".join(items[:MAX_NAMES]) + more


def list_actions(document, items, rows):
    """Returns what to do, the most urgent first: (words, id of the section with the details)."""
    counts, actions = document["counts"], []
    if is_incomplete(counts, document["gates"]):
        reason, count = count_reasons(rows)[0]
        words = f"{count} of {counts['sessions']} sessions have no result: {reason}"
        actions.append((f"Correct the archive: {words}", "failed"))
    if items["vanished"]:
        words = "Restore these sessions, or delete their results if they were removed on purpose"
        actions.append((f"{words}: {shorten(items['vanished'])}", "vanished"))
    if items["lost_results"]:
        actions.append((f"Find out why these sessions lost their result: {shorten(items['lost_results'])}", "failed"))
    if items["cameras_changed"]:
        actions.append((f"Examine these cameras: {shorten(items['cameras_changed'])}", "cameras"))
    if items["lamps_moved"]:
        actions.append((f"Survey these lamps: {shorten(items['lamps_moved'])}", "lamps"))
    missed = [gate["name"] for gate in document["gates"] if not gate["passed"] and not items.get(gate["name"])]
    if missed:
        actions.append((f"Check the gates that are not met: {', '.join(missed)}", "gates"))
    without_result = counts["no_result"] + counts["crashed"]
    for number, words, section in (
        (without_result, "have no result", "failed"),
        (counts["gate"], "miss a gate of their own", "session-gates"),
        (counts["look"], "passed with remarks", "look"),
    ):
        if number and section not in [known for _, known in actions]:
            actions.append((f"{number} of {counts['sessions']} sessions {words}", section))
    return actions


def verdict_part(document, items, rows):
    """The verdict and what to do, at the top of the page."""
    counts = document["counts"]
    verdict = "INCOMPLETE" if is_incomplete(counts, document["gates"]) else "PASS" if document["passed"] else "FAIL"
    html = f'<p class="verdict">{verdict}</p>\n'
    actions = list_actions(document, items, rows)
    if not actions:
        return html + "<p>Nothing to do.</p>\n"
    lines = "".join(f'<li><a href="#{section}">{escape(words)}</a></li>' for words, section in actions)
    return html + f"<h2>Actions, most urgent first</h2><ol>{lines}</ol>\n"


def page(run, rows, document, items, fleet, parts):
    html = '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
    html += '<meta name="viewport" content="width=device-width, initial-scale=1">'
    html += f"<title>Reprocessed archive</title><style>{STYLE}</style></head><body><main>\n<h1>Reprocessed archive</h1>\n"
    html += verdict_part(document, items, rows)
    html += look_here(rows)
    if items["vanished"]:
        html += '<h2 id="vanished">No longer in the archive</h2>\n'
        html += table(["session"], [(name,) for name in items["vanished"]], "changes.json")
    html += fleet
    html += '<h2 id="gates">Gates</h2>\n'
    gates = document["gates"]
    words = [(g["name"], number(g["value"]), g["limit"], "met" if g["passed"] else "not met") for g in gates]
    html += table(["gate", "value", "at most", ""], words)
    html += f"<p>Version {escape(run['version'])}, toolbox {run['toolbox'][:12]}.</p>\n<h2>Sessions</h2>\n"
    figures = [(name.replace("_", " "), number(value)) for name, value in document["counts"].items()]
    html += table(["metric", "value"], figures)
    failed = [row for row in rows if row["verdict"] not in HAVE_RESULT]
    if failed:
        lost = set(items["lost_results"])
        html += '<h2 id="failed">Without a result</h2>\n' + table(["reason", "sessions"], count_reasons(failed))
        columns = [(name_of(row), "had one earlier" if name_of(row) in lost else "", row["reason"]) for row in failed]
        html += table(["session", "", "reason"], sorted(columns, key=lambda one: not one[1]))
    missing = [row for row in rows if row["verdict"] == "gate"]
    if missing:
        html += '<h2 id="session-gates">A gate is not met</h2>\n'
        html += table(["session", "mean (mm)", "reason"], [(name_of(r), r["mean_mm"], r["reason"]) for r in missing])
    return html + parts + "</main></body></html>\n"


def had_result(name):
    """Returns true if RESULTS has a former result of a session that has none now."""
    return any(load(file)["verdict"] in HAVE_RESULT for file in (Path("former") / name).glob("*/row.json"))


def main():
    run, compare = load(Path(".state/run.json")), load(Path(".state/compare.json"))
    rows = read_table("summary.csv")
    before = read_table(Path(compare["previous"]) / "summary.csv") if compare["previous"] else []
    counts = counts_of(rows)
    changes, pairs = changes_of(rows, before) if compare["previous"] else (None, [])
    vanished = vanished_sessions(rows, compare["vanished"], before)
    lost = lost_results(rows, before, had_result)
    fleet_rows, lamp_rows = read_table("fleet.csv"), read_table("lamps.csv")
    fleet = fleet_of(fleet_rows, lamp_rows)
    items = listed_items(vanished, lost, fleet)
    gates = DEFAULT_GATES | (read_gates(Path(compare["gates"])) if compare["gates"] else {})
    results = check_gates(gates, counts, changes, items)
    incomplete = is_incomplete(counts, results)
    passed = not incomplete and all(gate["passed"] for gate in results) and not sessions_beyond_gates(counts, results)
    parts = ""
    figures = [[float(row["mean_mm"]) for row in with_figures(some)] for some in (rows, before)]
    if figures[0]:
        parts += "<h2>Errors</h2>\n" + picture(pictures.distribution(*figures), "Mean errors of the sessions")
    if changes:
        parts += comparison(run, Path(compare["previous"]), rows, before, changes, pairs)
    document = {"counts": counts, "changes": changes, "gates": results, "passed": passed, "fleet": fleet}
    document |= {"vanished": vanished, "lost_results": lost}
    write_whole("changes.json", json_text({"format": "vlp-archive-changes/1", **document}))
    write_whole("overview.html", page(run, rows, document, items, fleet_page.page(fleet, fleet_rows, lamp_rows), parts))


if __name__ == "__main__":
    gc.disable()  # of an archive's many rows none go in circles
    main()
