# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Writes changes.json and overview.html from summary.csv, in RESULTS. The page is self-contained and has no scripts."""
import gc
from html import escape
from pathlib import Path

import fleet_page
import pictures
from changes import DEFAULT_GATES, VERDICTS_WITH_RESULT, check_gates, collect_gate_items, compare_results, count_reasons
from changes import count_failed_sessions, count_verdicts, describe_first, find_lost_results, find_vanished_sessions
from changes import is_incomplete, join_items, list_suspects, load_json, read_gates, rows_with_mean, session_name
from files import json_text, read_table, write_atomically
from fleet import analyze_fleet
from pictures import number, picture, table
from plausibility import WITHOUT_RESULT

MAX_LISTED = 6  # sessions that differ most
MAX_EXAMINED = 200  # sessions with changed inputs whose changed files are listed

STYLE = """body { font: 16px/1.5 sans-serif; max-width: 60rem; margin: 1rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse } td, th { text-align: left; padding: 0.2rem 0.8rem; border-bottom: 1px solid #ccc }
.wide { overflow-x: auto } img { max-width: 100% } .verdict { font-size: 2rem; font-weight: bold }"""


def read_input_digests(results, name):
    """Returns the digest of each input of a session at its last run in `results`."""
    files = (results / place / name / "row.json" for place in ("sessions", "failed"))
    return next((load_json(file).get("parts", {}) for file in files if file.exists()), {})


def changed_inputs(previous, rows, before, changes):
    html = "<h2>Sessions with changed inputs</h2>\n"
    by_name, listed = {session_name(row): row for row in rows}, []
    rows_before = {session_name(row): row for row in before}
    lost = changes["lost_with_changed_inputs"]
    for name in list(dict.fromkeys([*lost, *changes["sessions_with_changed_inputs"]]))[:MAX_EXAMINED]:
        parts_now, parts_before = read_input_digests(Path("."), name), read_input_digests(previous, name)
        files = sorted(part for part in {*parts_now, *parts_before} if parts_now.get(part) != parts_before.get(part))
        what = "lost its result" if name in lost else by_name[name]["verdict"]
        values = [row.get(key, "") for key in COMPARED for row in (rows_before[name], by_name[name])]
        listed.append((name, ", ".join(files) if parts_before else "not known", what, *values))
    columns = [f"{key.replace('_', ' ')} {when}" for key in COMPARED for when in ("before", "now")]
    html += table(["session", "changed inputs", "now", *columns], listed)
    more = changes["changed_inputs"] - len(listed)
    return html + (f"<p>and {more} more, in changes.json</p>\n" if more else "")


def comparison(previous, rows, before, changes, pairs):
    html = "<h2>Comparison with earlier results</h2>\n"
    counts = [(words, changes[key]) for words, key in COUNTED]
    html += table(["", "sessions"], [(words, len(one) if isinstance(one, list) else one) for words, one in counts])
    if pairs:
        html += f"<p>Mean change: {number(changes['mean_difference_mm'])} mm"
        if "interval_95_mm" in changes:
            low, high = changes["interval_95_mm"]
            html += f", 95 % interval {low:.4g} to {high:.4g} mm"
        html += f": <strong>{escape(changes['verdict'])}</strong></p>\n"
        cells = [(session_name(row), old["mean_mm"], row["mean_mm"], f"{change:+.4g}") for row, old, change in pairs]
        html += "<h2>Sessions that differ most</h2>\n"
        html += table(["session", "before (mm)", "now (mm)", "change (mm)"], cells[:MAX_LISTED])
    if changes["changed_inputs"]:
        html += changed_inputs(previous, rows, before, changes)
    return html


COMPARED = ("verdict", "mean_mm", "rms_px")  # columns shown before and now for sessions with changed inputs

COUNTED = [("better", "better"), ("worse", "worse"), ("the same", "same"), ("newly without a result", "newly_failed")]
COUNTED += [("newly with a result", "newly_succeeded"), ("with changed inputs", "changed_inputs")]
COUNTED += [("with changed inputs, newly without a result", "lost_with_changed_inputs")]
COUNTED += [("new", "only_now"), ("no longer in the archive", "only_before")]


def list_sessions_to_review(rows):
    columns = ["session", "mean (mm)", "images skipped", "rejected lamps (captures)", "remarks"]
    keys = ("mean_mm", "images_skipped", "rejected_lamps", "remarks")
    cells = [(session_name(row), *(row[key] for key in keys)) for row in rows if row["verdict"] == "review"]
    return '<h2 id="review">Passed with remarks</h2>\n' + table(columns, cells) if cells else ""


ACTIONS = [
    ("vanished", "Restore these sessions, or delete their results if they were removed on purpose", "vanished"),
    ("suspect", "Check these sessions", "suspect"),
    ("lost_results", "Find out why these sessions lost their result", "failed"),
    ("cameras_changed", "Examine these cameras", "cameras"),
    ("lamps_moved", "Survey these lamps", "lamps"),
]


def list_actions(document, items, rows):
    """Returns the actions, most urgent first: (description, id of the section with the details)."""
    counts, actions = document["counts"], []
    if is_incomplete(counts, document["gates"]):
        reason, count = count_reasons(rows)[0]
        words = f"{count} of {counts['sessions']} sessions have no result: {reason}"
        actions.append((f"Correct the archive: {words}", "failed"))
    listed = [(words, join_items(items.get(name) or [], 5), section) for name, words, section in ACTIONS]
    actions += [(f"{words}: {names}", section) for words, names, section in listed if names]
    missed = [gate["name"] for gate in document["gates"] if not gate["passed"] and not items.get(gate["name"])]
    if missed:
        actions.append((f"Check the gates that are not met: {', '.join(missed)}", "gates"))
    without_result = counts["no_result"] + counts["crashed"]
    for number, words, section in (
        (without_result, "have no result" + describe_first(rows, WITHOUT_RESULT), "failed"),
        (counts["gate"], "miss a gate of their own" + describe_first(rows, ("gate",)), "session-gates"),
        (counts["review"], "passed with remarks", "review"),
    ):
        if number and section not in [known for _, known in actions]:
            actions.append((f"{number} of {counts['sessions']} sessions {words}", section))
    return actions


def render_verdict(document, items, rows):
    """Renders the verdict and the list of actions."""
    counts = document["counts"]
    verdict = "INCOMPLETE" if is_incomplete(counts, document["gates"]) else "PASS" if document["passed"] else "FAIL"
    html = f'<p class="verdict">{verdict}</p>\n'
    actions = list_actions(document, items, rows)
    lines = "".join(f'<li><a href="#{section}">{escape(words)}</a></li>' for words, section in actions)
    listed = f"<h2>Actions, most urgent first</h2><ol>{lines}</ol>\n"
    return html + (listed if actions else "<p>Nothing to do.</p>\n")


def render_page(run, rows, document, items, fleet, parts):
    html = '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
    html += '<meta name="viewport" content="width=device-width, initial-scale=1">'
    html += f"<title>Reprocessed archive</title><style>{STYLE}</style></head><body><main>\n"
    html += "<h1>Reprocessed archive</h1>\n" + render_verdict(document, items, rows) + list_sessions_to_review(rows)
    if items["vanished"]:
        html += '<h2 id="vanished">No longer in the archive</h2>\n'
        html += table(["session"], [(name,) for name in items["vanished"]], "changes.json")
    if items.get("suspect"):
        html += '<h2 id="suspect">Not plausible</h2>\n' + table(["session"], [(words,) for words in items["suspect"]])
    html += fleet
    html += '<h2 id="gates">Gates</h2>\n'
    gates = document["gates"]
    words = [(g["name"], number(g["value"]), g["limit"], "met" if g["passed"] else "not met") for g in gates]
    html += table(["gate", "value", "at most", ""], words)
    html += f"<p>Version {escape(run['version'])}, toolbox {run['toolbox'][:12]}.</p>\n<h2>Sessions</h2>\n"
    counts = [(name.replace("_", " "), number(value)) for name, value in document["counts"].items()]
    html += table(["metric", "value"], counts)
    failed = [row for row in rows if row["verdict"] not in VERDICTS_WITH_RESULT]
    if failed:
        lost = set(items["lost_results"])
        html += '<h2 id="failed">Without a result</h2>\n' + table(["reason", "sessions"], count_reasons(failed))
        columns = [(session_name(r), "had one earlier" * (session_name(r) in lost), r["reason"]) for r in failed]
        html += table(["session", "", "reason"], sorted(columns, key=lambda column: not column[1]))
    missing = [row for row in rows if row["verdict"] == "gate"]
    if missing:
        html += '<h2 id="session-gates">A gate is not met</h2>\n'
        cells = [(session_name(r), r["mean_mm"], r["reason"]) for r in missing]
        html += table(["session", "mean (mm)", "reason"], cells)
    return html + parts + "</main></body></html>\n"


def had_result(name):
    """Returns true if RESULTS has a former result of a session that has none now."""
    rows = (load_json(file) for file in (Path("former") / name).glob("*/row.json"))
    return any(row["verdict"] in VERDICTS_WITH_RESULT for row in rows)


def main():
    run, compare = load_json(Path(".state/run.json")), load_json(Path(".state/compare.json"))
    rows = read_table("summary.csv")
    before = read_table(Path(compare["previous"]) / "summary.csv") if compare["previous"] else []
    counts = count_verdicts(rows)
    changes, pairs = compare_results(rows, before) if compare["previous"] else (None, [])
    vanished = find_vanished_sessions(rows, compare["vanished"], before)
    lost = find_lost_results(rows, before, had_result)
    fleet_rows, lamp_rows = read_table("fleet.csv"), read_table("lamps.csv")
    fleet = analyze_fleet(fleet_rows, lamp_rows)
    items = collect_gate_items(vanished, lost, fleet, compare["faults"] + list_suspects(rows, before))
    gates = DEFAULT_GATES | (read_gates(Path(compare["gates"])) if compare["gates"] else {})
    results = check_gates(gates, counts, changes, items)
    incomplete = is_incomplete(counts, results)
    passed = not incomplete and all(gate["passed"] for gate in results) and not count_failed_sessions(counts, results)
    parts = ""
    means = [[float(row["mean_mm"]) for row in rows_with_mean(results)] for results in (rows, before)]
    if means[0]:
        parts += "<h2>Errors</h2>\n" + picture(pictures.distribution(*means), "Mean errors of the sessions")
    if changes:
        parts += comparison(Path(compare["previous"]), rows, before, changes, pairs)
    document = {"counts": counts, "changes": changes, "gates": results, "passed": passed, "fleet": fleet}
    document |= {"vanished": vanished, "lost_results": lost, "suspect": items["suspect"]}
    write_atomically("changes.json", json_text({"format": "vlp-archive-changes/2", **document}))
    over_time = fleet_page.render_page(fleet, fleet_rows, lamp_rows)
    write_atomically("overview.html", render_page(run, rows, document, items, over_time, parts))


if __name__ == "__main__":
    gc.disable()  # saves time: the many rows of an archive have no reference cycles
    main()
