# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Finds sessions that are not plausible among those of the archive: copies, lost inputs, unusual or missing metrics, a
lens or a rotation that is that of another camera."""
import json
import math
import statistics
from collections import Counter, defaultdict

MIN_SESSIONS = 8  # with a metric, for a median
MAX_ODD_FRACTION = 0.1  # of the sessions, or one: what all others have is usual
WITHOUT_RESULT = ("no result", "crashed")
MIN_DEVIATION = 6  # robust standard deviations of the logarithm
# Ratio to the median from which a metric is unusual; below 1 if larger values are better.
UNUSUAL_RATIO = {"mtf50": 0.85, "mean_mm": 5, "height_rms_mm": 5, "yaw_rms_deg": 5, "dispersion_mm": 5}
UNUSUAL_RATIO |= {"normalized_error_rms": 5, "rotation_px": 5}
LENS = ("focal_x_px", "focal_y_px", "principal_point_x_px", "principal_point_y_px")
IDENTIFYING = {"boards": LENS, "rotation": ("rotation_center_x_px", "rotation_center_y_px")}
MIN_OWN = 4  # sessions of cameras that have several, for the usual distance between these
MIN_RATIO, MIN_DISTANCE_PX = 10, 0.1  # of the distance from the nearest session of the same camera


def count_inputs(text):
    """Returns {input: number of files} of a column such as "boards 20, check 12"."""
    return Counter({name: int(count) for name, count in (part.rsplit(" ", 1) for part in text.split(", ") if part)})


def format_counts(counts):
    return ", ".join(f"{name} {count}" for name, count in sorted(counts.items()))


def lost_inputs(row, before):
    """Returns the inputs with fewer files than `before` has or expects."""
    now, expected = count_inputs(row.get("files", "")), count_inputs(before.get("expected", ""))
    return [f"{name} has {now[name]} of {count} files" for name, count in expected.items() if now[name] < count]


def session_name(row):
    return f"{row['camera']}/{row['session']}"


def rows_with_result(rows):
    return [row for row in rows if row.get("verdict") not in WITHOUT_RESULT]


def find_usual(values):
    """Returns the value that all sessions but a few have; None if there is none, or too few sessions."""
    value, count = Counter(values).most_common(1)[0] if len(values) >= MIN_SESSIONS else (None, 0)
    return value if len(values) - count <= max(1, MAX_ODD_FRACTION * len(values)) else None


def find_lost_inputs(rows):
    """Yields inputs with fewer files than the session had before, or than almost all sessions with a result have."""
    counts = [count_inputs(row["files"]) for row in rows_with_result(rows) if row.get("files")]
    usual = Counter({name: find_usual([count[name] for count in counts]) or 0 for name in set().union(*counts)})
    for row in rows:
        expected = count_inputs(row.get("expected", ""))
        expected |= usual if row.get("verdict") not in WITHOUT_RESULT else Counter()
        yield from ((session_name(row), reason) for reason in lost_inputs(row, {"expected": format_counts(expected)}))


def find_copies(rows):
    first, former = {}, {row["former_inputs"]: row for row in rows if row.get("former_inputs")}
    for row in rows:
        name, inputs = session_name(row), row.get("inputs")
        if inputs and (other := first.setdefault(inputs, row)) is not row:
            yield name, f"is a copy of {session_name(other)}"
            continue
        if (other := former.get(inputs, row)) is not row:
            yield name, f"has the inputs that {session_name(other)} had: renamed or exchanged?"
        for part in json.loads(row.get("copyable") or "{}").items():
            if (other := first.setdefault(part, row)) is not row:
                yield name, f"{part[0]}: the same files as in {session_name(other)}"


def find_unusual_metrics(rows):
    complete = rows_with_result(rows)
    for metric, limit in UNUSUAL_RATIO.items():
        if find_usual([bool(row.get(metric)) for row in complete]):
            yield from ((session_name(row), f"{metric} is not known") for row in complete if not row.get(metric))
        logs = {session_name(row): math.log(float(row[metric])) for row in rows if float(row.get(metric) or 0) > 0}
        if len(logs) < MIN_SESSIONS:
            continue
        median = statistics.median(logs.values())
        sd = 1.4826 * statistics.median(abs(value - median) for value in logs.values())
        for name, value in logs.items():
            deviation = (value - median) * math.copysign(1, math.log(limit))
            if deviation > max(abs(math.log(limit)), MIN_DEVIATION * sd):
                ratio = math.exp(value - median)
                yield name, f"{metric} is {math.exp(value):.4g}, {ratio:.3g} times the median of the archive"


def find_foreign_inputs(rows):
    for part, columns in IDENTIFYING.items():
        places = {session_name(row): [float(row[one]) for one in columns] for row in rows if row.get(columns[0])}
        by_camera, own = defaultdict(list), {}
        for name in places:
            by_camera[name.split("/")[0]].append(name)
        for names in filter(lambda names: len(names) > 1, by_camera.values()):
            own |= {name: min(math.dist(places[name], places[one]) for one in names if one != name) for name in names}
        if len(own) < MIN_OWN:
            continue
        limit = max(MIN_DISTANCE_PX, MIN_RATIO * sorted(own.values())[len(own) // 4])
        for name, distance in own.items():
            if distance < limit:
                continue
            camera = name.split("/")[0]
            others = (one for one in places if one.split("/")[0] != camera)
            distances = ((math.dist(places[name], places[one]), one) for one in others)
            nearest, other = min(distances, default=(math.inf, ""))
            if nearest < distance / MIN_RATIO:
                words = f"{part}: of {other.split('/')[0]}? {distance:.2g} px from the nearest session of {camera}, "
                yield part, name, words + f"{nearest:.2g} px from {other}"


def find_cause(row):
    """Returns the first warning of a session, in the order of the steps, in a list; or the skipped images of a step."""
    remarks = [words for words in row.get("remarks", "").split("; ") if words]
    warnings = [words for words in remarks if "skipped" not in words and not words.startswith("the first, ")]
    return warnings[:1] or remarks[:2]  # "12 images skipped" and "the first, ..."


def find_suspects(rows):
    """Returns {CAMERA/SESSION: list of reasons}, causes first."""
    found, unusual = defaultdict(list), defaultdict(list)
    for name, reason in find_unusual_metrics(rows):
        unusual[name].append(reason)
    for name, reason in [*find_lost_inputs(rows), *find_copies(rows)]:
        found[name].append(reason)
    for part, name, reason in find_foreign_inputs(rows):
        # A camera that was tilted in the meantime can have the rotation center of another one, but usual errors.
        if part == "boards" or unusual[name]:
            found[name].append(reason)
    for row in rows:
        if reasons := unusual[session_name(row)]:
            found[session_name(row)] += find_cause(row) + reasons
    return found
