# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Compares the results of an archive with earlier ones, and checks the gates of the archive (README.md)."""
import json
import math
import re
import statistics
from collections import Counter

import yaml

from plausibility import WITHOUT_RESULT, find_cause, lost_inputs, session_name

VERDICTS_WITH_RESULT = ("pass", "review", "gate")
MIN_CAMERAS = 20  # as vlp-evaluate requires 20 reference points
MAX_EQUAL_CHANGE_MM = 0.001  # below all measurement uncertainties


def rows_with_mean(rows):
    return [row for row in rows if row["verdict"] in VERDICTS_WITH_RESULT and row["mean_mm"]]


def count_verdicts(rows):
    verdicts = [row["verdict"] for row in rows]
    means = sorted(float(row["mean_mm"]) for row in rows_with_mean(rows))
    counts = {"sessions": len(rows)}
    for verdict in ("pass", "review", "gate", "no result", "crashed"):
        counts[verdict.replace(" ", "_")] = verdicts.count(verdict)
    if means:
        counts["mean_mm"] = statistics.fmean(means)
        counts["median_mm"] = statistics.median(means)
        counts["p90_mm"] = means[math.ceil(0.9 * len(means)) - 1]
    return counts


def student_quantile_975(freedoms):
    """Returns the 97.5 % quantile of Student's t distribution by the Cornish-Fisher expansion. The error is below 0.001
    from 19 degrees of freedom on."""
    z = statistics.NormalDist().inv_cdf(0.975)
    first, second = (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96
    return z + first / freedoms + second / freedoms**2


def compute_interval(differences):
    """Returns the mean over cameras and its 95 % interval; None if there are too few cameras. differences: (camera,
    change)."""
    by_camera = {}
    for camera, change in differences:
        by_camera.setdefault(camera, []).append(change)
    means = [statistics.fmean(changes) for changes in by_camera.values()]
    mean = statistics.fmean(means)
    if len(means) < MIN_CAMERAS:
        return mean, None
    half = student_quantile_975(len(means) - 1) * statistics.stdev(means) / math.sqrt(len(means))
    return mean, [mean - half, mean + half]


def compare_results(rows, before_rows):
    """Returns the comparison for changes.json, and the pairs (row, earlier row, change of mean_mm), largest change
    first."""
    before = {session_name(row): row for row in before_rows}
    both = [(row, before[session_name(row)]) for row in rows if session_name(row) in before]
    same_inputs = [(row, old) for row, old in both if row["inputs"] == old["inputs"]]
    changes = {
        "only_now": len(rows) - len(both),
        "only_before": len(before) - len(both),
        "in_both": len(both),
        "same_inputs": len(same_inputs),
        "changed_inputs": len(both) - len(same_inputs),
        "sessions_with_changed_inputs": [session_name(row) for row, old in both if row["inputs"] != old["inputs"]],
        "newly_failed": [],
        "newly_succeeded": [],
    }
    pairs = []
    for row, old in both:
        has_result, had_result = row["verdict"] in VERDICTS_WITH_RESULT, old["verdict"] in VERDICTS_WITH_RESULT
        if had_result and not has_result:
            changes["newly_failed"].append(session_name(row))
        elif has_result and not had_result:
            changes["newly_succeeded"].append(session_name(row))
        elif has_result and row["inputs"] == old["inputs"] and row["mean_mm"] and old["mean_mm"]:
            pairs.append((row, old, float(row["mean_mm"]) - float(old["mean_mm"])))
    with_changed_inputs = set(changes["sessions_with_changed_inputs"])
    changes["lost_with_changed_inputs"] = sorted(set(changes["newly_failed"]) & with_changed_inputs)
    changes |= {
        "pairs": len(pairs),
        "better": sum(change < -MAX_EQUAL_CHANGE_MM for _, _, change in pairs),
        "worse": sum(change > MAX_EQUAL_CHANGE_MM for _, _, change in pairs),
        "same": sum(abs(change) <= MAX_EQUAL_CHANGE_MM for _, _, change in pairs),
    }
    if pairs:
        mean, interval = compute_interval([(row["camera"], change) for row, _, change in pairs])
        changes["mean_difference_mm"] = mean
        if interval:
            changes["interval_95_mm"] = interval
        if changes["same"] == len(pairs):
            changes["verdict"] = "the same"
        elif interval:
            better, worse = interval[1] < 0, interval[0] > 0
            changes["verdict"] = "better" if better else "worse" if worse else "inconclusive"
        else:
            changes["verdict"] = f"no comparison with fewer than {MIN_CAMERAS} cameras"
    pairs.sort(key=lambda pair: (-abs(pair[2]), session_name(pair[0])))
    return changes, pairs


def count_items(name):
    return lambda counts, changes, items: len(items[name]) if items.get(name) is not None else None


# Gates, all upper limits: smallest and largest valid limit, and the function that returns the value (None: unknown).
GATES = {
    "no_result": (0, math.inf, lambda counts, changes, items: counts["no_result"] + counts["crashed"]),
    "no_result_fraction": (0, 1, lambda counts, changes, items: fraction(counts, "no_result", "crashed")),
    "review_fraction": (0, 1, lambda counts, changes, items: fraction(counts, "review")),
    "gate_fraction": (0, 1, lambda counts, changes, items: fraction(counts, "gate")),
    "mean_mm": (0, math.inf, lambda counts, changes, items: counts.get("mean_mm")),
    "median_mm": (0, math.inf, lambda counts, changes, items: counts.get("median_mm")),
    "p90_mm": (0, math.inf, lambda counts, changes, items: counts.get("p90_mm")),
    "vanished": (0, math.inf, count_items("vanished")),
    "suspect": (0, math.inf, count_items("suspect")),
    "lost_results": (0, math.inf, count_items("lost_results")),
    "cameras_changed": (0, math.inf, count_items("cameras_changed")),
    "lamps_moved": (0, math.inf, count_items("lamps_moved")),
    "newly_failed": (0, math.inf, lambda _, now, items: now and (len(now["newly_failed"]) if now["in_both"] else None)),
    "worse_fraction": (0, 1, lambda _, now, items: now and (now["worse"] / now["pairs"] if now["pairs"] else None)),
    "mean_difference_mm": (-math.inf, math.inf, lambda *args: args[1] and args[1].get("interval_95_mm", [None] * 2)[1]),
}
DEFAULT_GATES = {"vanished": 0, "suspect": 0}
COMPLETENESS_GATES = ("no_result", "no_result_fraction")  # exit code 3 if one is not met


def fraction(counts, *verdicts):
    return sum(counts[verdict] for verdict in verdicts) / counts["sessions"]


def find_vanished_sessions(rows, known, before_rows):
    """Returns the sessions that the archive no longer has. known: sessions with a folder in RESULTS."""
    return sorted(({session_name(row) for row in before_rows} | set(known)) - {session_name(row) for row in rows})


def find_lost_results(rows, before_rows, had_result):
    """Returns the sessions that lost their result. had_result(name): true if RESULTS has a former result."""
    before = {session_name(row) for row in before_rows if row["verdict"] in VERDICTS_WITH_RESULT}
    names = [session_name(row) for row in rows if row["verdict"] not in VERDICTS_WITH_RESULT]
    return [name for name in names if name in before or had_result(name)]


def list_suspects(rows, before_rows):
    """Returns the descriptions of sessions that are not plausible, lost inputs that they had in earlier results, or
    have those that another session had there; and of earlier results with other inputs of every session."""
    before, found = {session_name(row): row for row in before_rows}, []
    owners = {row["inputs"]: name for name, row in before.items()}
    both = [row for row in rows if session_name(row) in before]
    if len(both) > 1 and all(row["inputs"] != before[session_name(row)]["inputs"] for row in both):
        found.append(f"--previous: all of {len(both)} sessions have other inputs there: is it of this archive?")
    for row in rows:
        name = session_name(row)
        was, owner = before.get(name, {}), owners.get(row["inputs"], name)
        known = [reason for reason in row.get("suspect", "").split("; ") if reason]
        moved = owner != name and was.get("inputs") != row["inputs"]
        known = [f"has the inputs that {owner} had: renamed or exchanged?"] * moved + known
        if reasons := dict.fromkeys([*known, *lost_inputs(row, was)]):
            found.append(f"{name}: {'; '.join(reasons)}")
    return found


def describe_date(change):
    """Describes the kind and the date of a change."""
    before, since = (end["date"] or end["session"] for end in (change["before"], change["since"]))
    if change["kind"] == "undecided":
        return f"undecided: step at {since} or drift"
    return f"drift from {before} to {since}" if change["kind"] == "drift" else f"step between {before} and {since}"


def describe_camera(alarm):
    change = alarm["changes"][0]
    return f"{alarm['camera']}: {change['column']} {change['change']:+.4g}, {describe_date(change)}"


def describe_lamp(lamp):
    date = describe_date(lamp | {"kind": "step"})
    place = f"{lamp['room']} " if lamp["room"] else ""
    return f"{place}lamp {lamp['lamp']} (map {lamp['map']}): {abs(complex(*lamp['displacement_mm'])):.2f} mm, {date}"


def collect_gate_items(vanished, lost, fleet, suspects=()):
    """Returns {gate: descriptions of the items that it counts}; None for a gate if there were too few data to test."""
    tested = fleet["between_sessions"]
    cameras_tested = any(tau is not None for name, tau in tested.items() if name != "lamps")
    return {
        "vanished": vanished,
        "suspect": list(suspects),
        "lost_results": lost,
        "cameras_changed": [describe_camera(alarm) for alarm in fleet["cameras"]] if cameras_tested else None,
        "lamps_moved": [describe_lamp(lamp) for lamp in fleet["lamps"]] if tested.get("lamps") is not None else None,
    }


def read_gates(file):
    """Reads gates in format vlp-archive-gates/1: {name: limit}. Raises ValueError."""
    try:
        document = yaml.safe_load(file.read_text())
    except yaml.YAMLError as failure:
        raise ValueError(f"{file}: is not YAML: {' '.join(str(failure).split())}") from failure
    if not isinstance(document, dict) or document.get("format") != "vlp-archive-gates/1":
        raise ValueError(f"{file}: should begin with format: vlp-archive-gates/1")
    gates = document.get("gates")
    if set(document) != {"format", "gates"} or not isinstance(gates, dict) or not gates:
        raise ValueError(f"{file}: should hold format and gates: {{NAME: LIMIT}}")
    for name, limit in gates.items():
        if name not in GATES:
            raise ValueError(f"{file}: gate '{name}' is unknown; there are: {', '.join(GATES)}")
        if isinstance(limit, bool) or not isinstance(limit, (int, float)) or not math.isfinite(limit):
            raise ValueError(f"{file}: {name}: should be a number")
        smallest, largest, _ = GATES[name]
        if not smallest <= limit <= largest:
            allowed = "a fraction from 0 to 1" if largest == 1 else "0 or more"
            raise ValueError(f"{file}: {name}: should be {allowed}, not {limit:g}")
    return gates


def check_gates(gates, counts, changes, items):
    """Compares each value with its limit. An unknown value fails its gate, for example without earlier results."""
    results = []
    for name, limit in gates.items():
        value = GATES[name][2](counts, changes, items)
        passed = value is not None and value <= limit
        results.append({"name": name, "value": value, "limit": limit, "passed": passed})
    return results


def count_failed_sessions(counts, gates):
    """Returns the number of sessions that miss a gate of their own; 0 if `gates` has a limit for their fraction."""
    return 0 if any(gate["name"] == "gate_fraction" for gate in gates) else counts["gate"]


def is_incomplete(counts, gates):
    """Returns true if no session has a result, or if more than the gates allow have none."""
    missed = any(gate["name"] in COMPLETENESS_GATES and not gate["passed"] for gate in gates)
    return missed or not any(counts.get(verdict) for verdict in VERDICTS_WITH_RESULT)


def count_reasons(rows):
    """Returns (reason, sessions) of the sessions without a result, most frequent first. Session names are removed."""
    failed = [row for row in rows if row["verdict"] not in VERDICTS_WITH_RESULT]
    reasons = Counter(re.sub(re.escape(session_name(row)) + "/?", "", row["reason"]) for row in failed)
    return sorted(reasons.items(), key=lambda item: (-item[1], item[0]))


def describe_first(rows, verdicts):
    """Returns ", as CAMERA/SESSION: REASON", with the cause first, of the first session with one of these verdicts."""
    row = next((row for row in rows if row["verdict"] in verdicts), None)
    causes = find_cause(row) if row and row["verdict"] not in WITHOUT_RESULT else []
    return f", as {session_name(row)}: {'; '.join([*causes, row['reason']])}" if row else ""


def join_items(items, max_items=20):
    more = f"; and {len(items) - max_items} more in changes.json" if len(items) > max_items else ""
    return "; ".join(items[:max_items]) + more


def load_json(file):
    return json.loads(file.read_text())
