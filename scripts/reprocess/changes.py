# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""What changed from one run over an archive to the next, and the gates for it.

Sessions are paired by camera and session. One that had a result and has none now counts, whatever became of its
inputs; figures are compared where the inputs are the same. Sessions of a camera share its
lens, so cameras are what the interval counts: the mean over cameras of the change of mean_mm, with its
95 % interval by Student's distribution, of 20 cameras or more. A session whose figure changes by no more
than a micrometer is the same.

The gates of counts limit how many items a list may have: vanished sessions, lost results, changed cameras, moved lamps.
A vanished session has a folder in RESULTS or a row in the earlier results, and no folder in the archive. A lost result
belongs to a session that has none now and had one in the earlier results or in former/.
"""
import json
import math
import re
import statistics
from collections import Counter

import yaml

HAVE_RESULT = ("pass", "look", "gate")
FEWEST_CAMERAS = 20  # as vlp-evaluate asks for 20 stations
SAME_MM = 0.001  # below every measurement uncertainty


def name_of(row):
    return f"{row['camera']}/{row['session']}"


def with_figures(rows):
    return [row for row in rows if row["verdict"] in HAVE_RESULT and row["mean_mm"]]


def counts_of(rows):
    verdicts = [row["verdict"] for row in rows]
    figures = sorted(float(row["mean_mm"]) for row in with_figures(rows))
    counts = {"sessions": len(rows)}
    for verdict in ("pass", "look", "gate", "no result", "crashed"):
        counts[verdict.replace(" ", "_")] = verdicts.count(verdict)
    if figures:
        counts["mean_mm"] = statistics.fmean(figures)
        counts["median_mm"] = statistics.median(figures)
        counts["p90_mm"] = figures[math.ceil(0.9 * len(figures)) - 1]
    return counts


def student_975(freedoms):
    """Its quantile, by the expansion of Fisher and Cornish: to 0.001 from 19 degrees of freedom on."""
    z = statistics.NormalDist().inv_cdf(0.975)
    first, second = (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96
    return z + first / freedoms + second / freedoms**2


def interval_of(differences):
    """differences: (camera, change). Mean over cameras, and what it is within."""
    by_camera = {}
    for camera, change in differences:
        by_camera.setdefault(camera, []).append(change)
    means = [statistics.fmean(changes) for changes in by_camera.values()]
    mean = statistics.fmean(means)
    if len(means) < FEWEST_CAMERAS:
        return mean, None
    half = student_975(len(means) - 1) * statistics.stdev(means) / math.sqrt(len(means))
    return mean, [mean - half, mean + half]


def changes_of(rows, before_rows):
    before = {name_of(row): row for row in before_rows}
    both = [(row, before[name_of(row)]) for row in rows if name_of(row) in before]
    same_inputs = [(row, old) for row, old in both if row["inputs"] == old["inputs"]]
    changes = {
        "only_now": len(rows) - len(both),
        "only_before": len(before) - len(both),
        "in_both": len(both),
        "same_inputs": len(same_inputs),
        "other_inputs": len(both) - len(same_inputs),
        "with_other_inputs": [name_of(row) for row, old in both if row["inputs"] != old["inputs"]],
        "newly_failed": [],
        "newly_good": [],
    }
    pairs = []
    for row, old in both:
        good, was_good = row["verdict"] in HAVE_RESULT, old["verdict"] in HAVE_RESULT
        if was_good and not good:
            changes["newly_failed"].append(name_of(row))
        elif good and not was_good:
            changes["newly_good"].append(name_of(row))
        elif good and row["inputs"] == old["inputs"] and row["mean_mm"] and old["mean_mm"]:
            pairs.append((row, old, float(row["mean_mm"]) - float(old["mean_mm"])))
    changes["lost_with_other_inputs"] = sorted(set(changes["newly_failed"]) & set(changes["with_other_inputs"]))
    changes |= {
        "pairs": len(pairs),
        "better": sum(change < -SAME_MM for _, _, change in pairs),
        "worse": sum(change > SAME_MM for _, _, change in pairs),
        "same": sum(abs(change) <= SAME_MM for _, _, change in pairs),
    }
    if pairs:
        mean, interval = interval_of([(row["camera"], change) for row, _, change in pairs])
        changes["mean_difference_mm"] = mean
        if interval:
            changes["interval_95_mm"] = interval
            better, worse = interval[1] < 0, interval[0] > 0
            changes["verdict"] = "better" if better else "worse" if worse else "no evidence"
        else:
            changes["verdict"] = f"no comparison with fewer than {FEWEST_CAMERAS} cameras"
    pairs.sort(key=lambda pair: (-abs(pair[2]), name_of(pair[0])))
    return changes, pairs


def newly_failed(changes):
    return len(changes["newly_failed"]) if changes and changes["in_both"] else None


def worse_fraction(changes):
    return changes["worse"] / changes["pairs"] if changes and changes["pairs"] else None


def listed_in(name):
    return lambda counts, changes, items: len(items[name]) if items.get(name) is not None else None


# Gates, all upper limits: smallest and largest valid limit, and the function that returns the value (None: unknown).
GATES = {
    "no_result": (0, math.inf, lambda counts, changes, items: counts["no_result"] + counts["crashed"]),
    "no_result_fraction": (0, 1, lambda counts, changes, items: fraction(counts, "no_result", "crashed")),
    "look_fraction": (0, 1, lambda counts, changes, items: fraction(counts, "look")),
    "gate_fraction": (0, 1, lambda counts, changes, items: fraction(counts, "gate")),
    "mean_mm": (0, math.inf, lambda counts, changes, items: counts.get("mean_mm")),
    "median_mm": (0, math.inf, lambda counts, changes, items: counts.get("median_mm")),
    "p90_mm": (0, math.inf, lambda counts, changes, items: counts.get("p90_mm")),
    "vanished": (0, math.inf, listed_in("vanished")),
    "lost_results": (0, math.inf, listed_in("lost_results")),
    "cameras_changed": (0, math.inf, listed_in("cameras_changed")),
    "lamps_moved": (0, math.inf, listed_in("lamps_moved")),
    "newly_failed": (0, math.inf, lambda counts, changes, items: newly_failed(changes)),
    "worse_fraction": (0, 1, lambda counts, changes, items: worse_fraction(changes)),
    "mean_difference_mm": (
        -math.inf,
        math.inf,
        lambda counts, changes, items: changes and changes.get("interval_95_mm", [None, None])[1],
    ),
}
FORMER_GATES = {f"{name}_share": f"{name}_fraction" for name in ("no_result", "look", "gate", "worse")}
DEFAULT_GATES = {"vanished": 0}
COMPLETENESS_GATES = ("no_result", "no_result_fraction")  # exit code 3 if one is not met


def fraction(counts, *verdicts):
    return sum(counts[verdict] for verdict in verdicts) / counts["sessions"]


def vanished_sessions(rows, known, before_rows):
    """Returns the sessions that the archive no longer has. known: sessions with a folder in RESULTS."""
    return sorted(({name_of(row) for row in before_rows} | set(known)) - {name_of(row) for row in rows})


def lost_results(rows, before_rows, had_result):
    """Returns the sessions that lost their result. had_result(name): true if RESULTS has a former result."""
    before = {name_of(row) for row in before_rows if row["verdict"] in HAVE_RESULT}
    names = [name_of(row) for row in rows if row["verdict"] not in HAVE_RESULT]
    return [name for name in names if name in before or had_result(name)]


def describe_date(change):
    """Returns the kind of a change and when it happened, in words."""
    before, since = (end["date"] or end["session"] for end in (change["before"], change["since"]))
    if change["kind"] == "undecided":
        return f"undecided: step at {since} or drift"
    return f"drift from {before} to {since}" if change["kind"] == "drift" else f"step between {before} and {since}"


def describe_camera(alarm):
    change = alarm["changes"][0]
    return f"{alarm['camera']}: {change['figure']} {change['change']:+.4g}, {describe_date(change)}"


def describe_lamp(lamp):
    date = describe_date(lamp | {"kind": "step"})
    place = f"{lamp['room']} " if lamp["room"] else ""
    return f"{place}lamp {lamp['lamp']} (map {lamp['map']}): {abs(complex(*lamp['moved_mm'])):.2f} mm, {date}"


def listed_items(vanished, lost, fleet):
    """Returns the items that the gates of counts count, in words; None where nothing could be tested."""
    tested = fleet["between_sessions"]
    cameras_tested = any(tau is not None for name, tau in tested.items() if name != "lamps")
    return {
        "vanished": vanished,
        "lost_results": lost,
        "cameras_changed": [describe_camera(alarm) for alarm in fleet["cameras"]] if cameras_tested else None,
        "lamps_moved": [describe_lamp(lamp) for lamp in fleet["lamps"]] if tested.get("lamps") is not None else None,
    }


def read_gates(file):
    """format: vlp-archive-gates/1, gates: {NAME: LIMIT}. Throws ValueError."""
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
        if name in FORMER_GATES:
            raise ValueError(f"{file}: gate '{name}' is now called '{FORMER_GATES[name]}'")
        if name not in GATES:
            raise ValueError(f"{file}: gate '{name}' is unknown; there are: {', '.join(GATES)}")
        if isinstance(limit, bool) or not isinstance(limit, (int, float)) or not math.isfinite(limit):
            raise ValueError(f"{file}: {name}: should be a number")
        least, largest, _ = GATES[name]
        if not least <= limit <= largest:
            meant = "a share from 0 to 1" if largest == 1 else "0 or more"
            raise ValueError(f"{file}: {name}: should be {meant}, not {limit:g}")
    return gates


def check_gates(gates, counts, changes, items):
    """Compares each value with its limit. An unknown value does not pass, for example without earlier results."""
    results = []
    for name, limit in gates.items():
        value = GATES[name][2](counts, changes, items)
        passed = value is not None and value <= limit
        results.append({"name": name, "value": value, "limit": limit, "passed": passed})
    return results


def sessions_beyond_gates(counts, gates):
    """Returns how many sessions miss a gate of their own; 0 if `gates` has a limit for their fraction."""
    return 0 if any(gate["name"] == "gate_fraction" for gate in gates) else counts["gate"]


def is_incomplete(counts, gates):
    """Returns true if no session has a result, or if more than the gates allow have none."""
    missed = any(gate["name"] in COMPLETENESS_GATES and not gate["passed"] for gate in gates)
    return missed or not any(counts[verdict] for verdict in HAVE_RESULT)


def count_reasons(rows):
    """Returns (reason, sessions) of the sessions without a result, most frequent first. Session names are removed."""
    failed = [row for row in rows if row["verdict"] not in HAVE_RESULT]
    reasons = Counter(re.sub(re.escape(name_of(row)) + "/?", "", row["reason"]) for row in failed)
    return sorted(reasons.items(), key=lambda item: (-item[1], item[0]))


def load(file):
    return json.loads(file.read_text())
