# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Prints a summary of a run over an archive. Exit code 3: too few sessions have a result; 1: a gate is not met."""
import sys
import time
from pathlib import Path

from changes import VERDICTS_WITH_RESULT, collect_gate_items, count_failed_sessions, count_reasons, is_incomplete
from changes import describe_first, join_items, load_json, session_name
from checks import INCOMPLETE
from files import print_lines, read_table
from layout import describe_missing_inputs
from run_page import restore

MAX_REASONS = 3


def describe_run(state, sessions):
    ran = {}  # a session may occur twice if its job was submitted again
    for file in sorted((state / "ran").glob("*")):
        for line in file.read_text().splitlines():
            name, *columns = line.split("\t")
            ran[name] = columns
    failed = sum(verdict in ("no result", "crashed") for verdict, _, _ in ran.values())
    cpu_s = sum(float(cost) for _, cost, _ in ran.values())
    size = sum(int(size) for _, _, size in ran.values())
    seconds = time.time() - float((state / "started").read_text())
    text = f"ran {len(ran)}, of them {failed} without a result; reused {sessions - len(ran)}; "
    return text + f"{seconds:.1f} s, {cpu_s:.1f} s of processor time in the programs, {size / 1e6:.2f} MB written"


def describe_incomplete(archive, rows):
    """Returns a line: how many sessions have no result, and the most frequent reason."""
    failed = [session_name(row) for row in rows if row["verdict"] not in VERDICTS_WITH_RESULT]
    reason, count = count_reasons(rows)[0]
    # [ARCHIVE-2] `have no result` | exit code 3: no result, or above `no_result` or `no_result_fraction` of `--gates`
    #   | reasons and missing inputs follow
    words = f"{len(failed)} of {len(rows)} sessions have no result; {count} of them: {reason}"
    return "; ".join(filter(None, [words, describe_missing_inputs(archive, failed)]))


def describe_missed_gate(gate, items):
    value = "has no value" if gate["value"] is None else f"is {gate['value']:.4g}"
    # [ARCHIVE-4] `is allowed` | exit code 1 (3: `no_result`, `no_result_fraction`); `vanished`: session no longer in
    #   the archive | see the message
    words = f"reprocess.sh: gate {gate['name']}: {value}, at most {gate['limit']} is allowed"
    return words + (f": {join_items(items[gate['name']])}" if items.get(gate["name"]) else "")


def describe(results, document, rows, items):
    """Yields the lines of the summary."""
    counts, changes, fleet = document["counts"], document["changes"], document["fleet"]
    yield f"this run    {describe_run(results / '.state', counts['sessions'])}"
    yield f"passed      {counts['pass']}"
    yield f"review      {counts['review']} passed with remarks; see the overview"
    yield f"gates       {counts['gate']} with a result that misses a gate"
    yield f"no result   {counts['no_result']}, and {counts['crashed']} that crashed; see failed/"
    yield from (f"            {count} of them: {reason}" for reason, count in count_reasons(rows)[:MAX_REASONS])
    named = {"lost_results": ("lost", " had a result before"), "vanished": ("vanished", " no longer in the archive")}
    for name, (title, words) in (named | {"suspect": ("suspect", "")}).items():
        if items[name]:
            yield f"{title:11} {len(items[name])}{words}: {join_items(items[name])}"
    if "median_mm" in counts:
        yield f"error       {counts['median_mm']:.3f} mm in the median session, 90 % below {counts['p90_mm']:.3f} mm"
    cost_s = sum(float(row["cpu_s"] or 0) for row in rows)
    each_s = cost_s / counts["sessions"]
    yield f"cost        {cost_s:.1f} s of processor time for all results, {each_s:.2f} s a session"
    yield f"fleet       {len(fleet['cameras'])} cameras changed, {len(fleet['lamps'])} lamps were moved"
    if changes:
        failed, verdict = len(changes["newly_failed"]), changes.get("verdict", "nothing to compare")
        words = f"changed     {changes['better']} better, {changes['worse']} worse, {changes['same']} the same, "
        yield words + f"{failed} newly without a result: {verdict}"
        if changes["changed_inputs"]:
            lost = len(changes["lost_with_changed_inputs"])
            yield f"inputs      {changes['changed_inputs']} with changed inputs, {lost} of them lost their result"
    yield f"overview    {results / 'overview.html'}"


def main():
    results = Path(sys.argv[1])
    restore(results)
    document, rows = load_json(results / "changes.json"), read_table(results / "summary.csv")
    counts = document["counts"]
    items = collect_gate_items(document["vanished"], document["lost_results"], document["fleet"], document["suspect"])
    print_lines(describe(results, document, rows, items))
    for gate in document["gates"]:
        if not gate["passed"]:
            print(describe_missed_gate(gate, items), file=sys.stderr)
    if beyond := count_failed_sessions(counts, document["gates"]):
        first = describe_first(rows, ("gate",))
        # [ARCHIVE-4] `miss a gate`
        words = f"reprocess.sh: {beyond} of {counts['sessions']} sessions miss a gate of their own{first}"
        print(f"{words}; gate_fraction of --gates allows more", file=sys.stderr)
    if is_incomplete(counts, document["gates"]):
        archive = Path(load_json(results / ".state/run.json")["archive"])
        print(f"reprocess.sh: error: {describe_incomplete(archive, rows)}", file=sys.stderr)
        return INCOMPLETE
    return 0 if document["passed"] else 1


if __name__ == "__main__":
    sys.exit(main())
