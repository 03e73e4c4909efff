# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Detects cameras that changed and lamps that were moved, from fleet.csv and lamps.csv.

Each parameter and axis of a camera is tested for a step at each session and for a steady drift, each lamp for a step.
Deviates z are the difference of the weighted means before and after the step, and the slope, divided by their standard
deviations. Errors of sessions have heavier tails than a normal distribution. The test statistic is therefore the
smallest |z| that remains if any one session is left out: one outlier makes neither a step nor a drift, and a step has at
least MIN_SIDE sessions on each side. The step with the largest statistic is the change point. The probability of any
false alarm in the whole fleet is at most FALSE_ALARM_RATE, half of it for drifts and half for steps. A p value of z is
multiplied by the number of tests (Bonferroni). A series of n sessions counts as n / SESSIONS_PER_TEST tests: simulated
with normal errors and with those of Student's t of 5 degrees of freedom, n = 6 to 60, its probability of a larger
statistic than 3 to 4 is at most that many times the two-sided tail of a normal deviate.

A detected change is a step, a drift or undecided, by the marginal likelihoods of the two models. Both have a mean and a
change with the same wide prior; a step also has a date, with equal prior probability for each of its K sessions:
  step:   mean over k of exp(z_k^2 / 2) sd_k        drift:   exp(z^2 / 2) sd
z and sd are those of the change at session k and of the slope over all sessions. The mean over k is the penalty for the
date. The kind is decided if one likelihood is MIN_ODDS times the other, a posterior probability of 95 % if steps and
drifts are equally frequent. Otherwise it is "undecided", and the change and its date are those of the step.

The reported standard deviations exclude variations between sessions (of lens or map). If neighboring sessions of the
whole fleet differ by more than reported, each parameter has a standard deviation between sessions, tau: the variance of
a session is sd^2 + tau^2. tau is estimated from the smallest 95 % of the differences, so that the few cameras and lamps
that changed do not increase it. It is then increased so that deviates decrease by a factor of 1 + 20 / n, because n
differences determine it only approximately: if deviates are divided by a scale with relative variance v,
exp(z^4 v / 2) times as many are beyond z as with the true scale; z = 4.5 and v = 2 / n, a conservative choice (n
independent differences would give 1 / (2 n)). Nothing is tested with fewer than MIN_DIFFERENCES differences.

A camera whose sessions scatter more than those of the fleet has its own tau (estimate_camera_taus()), by the squared
differences between neighboring sessions over all its parameters. The largest of a series, with 8 sessions the largest
two, are excluded, so that a change does not count as scatter. Cameras with fewer than MIN_OWN_SESSIONS sessions have the tau of the fleet.

`min_detectable` is the change of a parameter that is detected with DETECTION_PROBABILITY, for the sessions of the
median series: a drift, or a step in the middle.

A lamp displaced by d has an apparent offset d relative to the other lamps. The fixes use this lamp, too. Therefore the
apparent offset of lamp i is
  P_ij d / P_ii,   P = I - 11'/n - q q^H / |q|^2.
q are the positions in the map as complex numbers, relative to their mean. P projects out the four unknowns of a fix, a
similarity of the floor plan (level camera, lamps of about one height). The lamp with the largest change is reported,
its effect on the other lamps is removed, and they are tested again.
"""
import math
import statistics
from collections import defaultdict

from dates import days_since_1970
from outcome import TRACKED_UNITS, sd_column

FALSE_ALARM_RATE = 0.05
DETECTION_PROBABILITY = 0.95
NORMAL = statistics.NormalDist()
MIN_ODDS = 19  # likelihood ratio at which step or drift is decided
MIN_DIFFERENCES = 20
MIN_SIDE = 2  # sessions before and after a step
SESSIONS_PER_TEST = {"step": 15, "drift": 150}
REJECTION_LOSS = {"step": 0.5, "drift": 0.8}  # of the power: z increases by this / sqrt(sessions)
MAX_DIFFERENCES = 4000  # enough for 1 % of tau
TOLERANCE = 0.01  # of tau^2
KEPT_FRACTION = 0.95
VARIANCE_OF_KEPT = 0.7588  # of a normal deviate within 1.96: 1 - 2 * 1.96 phi(1.96) / 0.95
OWN_P = 0.01  # probability of an unnecessary own tau, which only reduces the sensitivity
MIN_OWN_SESSIONS = 5
OWN_VARIANCE_FACTOR = 1.6  # for the sum of squares, as neighboring differences share a session (simulated: 8 to 50)
MIN_SD_MM = 1e-3
WITH_LEVER_ARM = ("zenith", "rotation_center", "dispersion_offset")
MIN_LAMPS = 4  # among three a moved lamp cannot be identified


def truncated_variance(fraction):
    """Returns the variance of the standard normal deviates that remain if the central `fraction` is kept."""
    limit = NORMAL.inv_cdf((1 + fraction) / 2)
    return 1 - 2 * limit * NORMAL.pdf(limit) / fraction


def sum_of_smallest(differences, kept, tau2):
    return sum(sorted(square / (variance + 2 * tau2) for square, variance in differences)[:kept])


def solve_tau(groups, expected):
    """Returns the tau for which the normalized squares of the smallest differences sum up to `expected`; 0 if they do
    not exceed it. groups: (differences, number of the smallest to keep)."""

    def excess(tau2):
        return sum(sum_of_smallest(differences, kept, tau2) for differences, kept in groups) - expected

    low, high = 0.0, max(square for differences, _ in groups for square, _ in differences) / VARIANCE_OF_KEPT
    if excess(low) <= 0:
        return 0.0
    while excess(high) > 0:
        high *= 2
    while high - low > TOLERANCE * high:
        middle = (low + high) / 2
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    return math.sqrt(high)


def estimate_tau(differences):
    """Returns the standard deviation between sessions, tau; None with too few differences. differences: (square,
    reported variance)."""
    differences = [difference for difference in differences if difference[0]]
    if len(differences) < MIN_DIFFERENCES:
        return None
    sample = differences[:: 1 + len(differences) // MAX_DIFFERENCES]
    kept = math.ceil(KEPT_FRACTION * len(sample))
    return solve_tau([(sample, kept)], kept * VARIANCE_OF_KEPT / (1 + 20 / len(sample)) ** 2)


def chi2_quantile(p, freedoms):
    """Returns the quantile by the approximation of Wilson and Hilferty."""
    variance = 2 / (9 * freedoms)
    return freedoms * (1 - variance + NORMAL.inv_cdf(p) * math.sqrt(variance)) ** 3


def estimate_camera_taus(columns, between):
    """Returns {parameter: tau} for a camera whose sessions scatter significantly more than those of the fleet, for
    parameters with a larger tau than the fleet's; {} for other cameras. columns: those of collect_camera_series()."""
    groups, total, expected, count = defaultdict(list), 0.0, defaultdict(float), 0
    for column, (_, series) in columns.items():
        tau, differences = between.get(parameter_of(column)), squared_differences(series)
        if tau is None or len(series) < MIN_OWN_SESSIONS:
            continue
        kept = len(differences) - (2 if len(series) >= 8 else 1)  # a step causes one large difference, an outlier two
        groups[parameter_of(column)].append((differences, kept))
        fraction = (kept + 0.5) / len(differences)  # the limit is between two differences
        expected[parameter_of(column)] += kept * truncated_variance(fraction)
        total += sum_of_smallest(differences, kept, tau**2)
        count += kept
    freedoms = count / OWN_VARIANCE_FACTOR
    if not count or total / sum(expected.values()) < chi2_quantile(1 - OWN_P, freedoms) / freedoms:
        return {}
    own = {}
    for kind, of_kind in groups.items():
        known = sum(kept for _, kept in of_kind)
        own[kind] = solve_tau(of_kind, expected[kind] / (1 + 20 / known) ** 2)
    return {kind: tau for kind, tau in own.items() if tau > between[kind]}


def with_added_sd(series, tau):
    """Returns the series with tau added to its standard deviations."""
    return [(value, math.hypot(sd, tau)) for value, sd in series]


def squared_differences(series):
    """Returns (square, reported variance) of the difference between neighboring sessions. series: (value, sd)."""
    return [((b - a) ** 2, s**2 + t**2) for (a, s), (b, t) in zip(series, series[1:])]


def compute_steps(series):
    """Yields the step at each session except the first, and its sd."""
    weights = [1 / sd**2 for _, sd in series]
    total = sum(weights)
    weighted_total = sum(weight * value for weight, (value, _) in zip(weights, series))
    before = weighted_before = 0.0
    for weight, (value, _) in zip(weights[:-1], series):
        before += weight
        weighted_before += weight * value
        after = total - before
        yield (weighted_total - weighted_before) / after - weighted_before / before, math.sqrt(1 / before + 1 / after)


def compute_drift(times, series):
    """Returns the change of the fitted line from the first session to the last, and its sd; None if all times are
    equal."""
    weights = [1 / sd**2 for _, sd in series]
    middle = sum(weight * time for weight, time in zip(weights, times)) / sum(weights)
    sum_of_squares = sum(weight * (time - middle) ** 2 for weight, time in zip(weights, times))
    span = times[-1] - times[0]
    if not sum_of_squares > 0:
        return None
    slope = sum(weight * (time - middle) * value for weight, time, (value, _) in zip(weights, times, series))
    slope /= sum_of_squares
    return slope * span, span / math.sqrt(sum_of_squares)


def count_tests(all_series):
    """Returns {kind: number of tests of one deviate each with as many false alarms as those of the series}."""
    sessions = sum(len(series) for series in all_series)
    return {kind: math.ceil(sessions / number) for kind, number in SESSIONS_PER_TEST.items()}


def without_each(entries):
    """Yields the entries without the first, without the second, and so on."""
    return (entries[:i] + entries[i + 1 :] for i in range(len(entries)))


def least_z(z, others):
    """Returns the smallest of |z| and of the deviates `others` in the direction of z; 0 if one has the other sign."""
    return max(0.0, min([abs(z), *(math.copysign(1, z) * other for other in others)]))


def least_z_of_step(series, k):
    """Returns |z| of the step at session k without the session on which it depends most; 0 for one session on a
    side."""
    sides = [(sum(1 / sd**2 for _, sd in side), sum(value / sd**2 for value, sd in side)) for side in (series[:k], series[k:])]
    (before, weighted_before), (after, weighted_after) = sides

    def z(before, weighted_before, after, weighted_after):
        return (weighted_after / after - weighted_before / before) / math.sqrt(1 / before + 1 / after)

    if not MIN_SIDE <= k <= len(series) - MIN_SIDE:
        return 0.0
    rest = [z(before - 1 / sd**2, weighted_before - value / sd**2, after, weighted_after) for value, sd in series[:k]]
    rest += [z(before, weighted_before, after - 1 / sd**2, weighted_after - value / sd**2) for value, sd in series[k:]]
    return least_z(z(before, weighted_before, after, weighted_after), rest)


def least_z_of_drift(times, series):
    """Returns |z| of the drift without the session on which it depends most."""
    rest = [compute_drift(*some) or (0, 1) for some in zip(without_each(times), without_each(series))]
    change, sd = compute_drift(times, series)
    return least_z(change / sd, [change / sd for change, sd in rest])


def two_sided_p(z):
    """Returns the two-sided tail probability of a standard normal deviate."""
    return math.erfc(abs(z) / math.sqrt(2))


def session_times(rows):
    """Returns the days since 1970; the indices of the sessions if a date is missing."""
    days = [days_since_1970(row["date"]) for row in rows]
    return list(range(len(rows))) if None in days else days


def sort_by_date(rows):
    """Sorts rows by date; by the names of the sessions if a date is missing."""
    dated = all(row["date"] for row in rows)
    return sorted(rows, key=lambda row: (row["date"] if dated else "", row["session"], row["camera"]))


def identify(row):
    return {"camera": row["camera"], "session": row["session"], "date": row["date"]}


def collect_camera_series(rows):
    """Returns {camera: {column: (rows, [(value, sd)])}} from the sessions with a value. If a camera has a lever arm, a
    session without one assumed zero, which changes its zenith: it is excluded."""
    by_camera = defaultdict(list)
    for row in rows:
        by_camera[row["camera"]].append(row)
    found = {}
    for camera, camera_rows in sorted(by_camera.items()):
        found[camera] = {}
        camera_rows = sort_by_date(camera_rows)
        with_arm = [row for row in camera_rows if row["lever_arm_x_mm"]]
        for name, unit in TRACKED_UNITS.items():
            for axis in "xy":
                column = f"{name}_{axis}_{unit}"
                used = with_arm if with_arm and name in WITH_LEVER_ARM else camera_rows
                used = [row for row in used if row[column] and float(row[sd_column(column)] or 0) > 0]
                if not all(row["date"] for row in camera_rows):
                    used = sort_by_date(used)  # the rows without a date may be excluded
                if len(used) > 1:
                    series = [(float(row[column]), float(row[sd_column(column)])) for row in used]
                    found[camera][column] = (used, series)
    return found


def parameter_of(column):
    return column.rsplit("_", 2)[0]


def log_sum_exp(values):
    largest = max(values)
    return largest + math.log(sum(math.exp(value - largest) for value in values))


def decide_kind(step_changes, drift_change):
    """Returns "step", "drift" or "undecided" by the marginal likelihoods in the module docstring. Each change is
    (change, sd); drift_change may be None."""
    if drift_change is None:
        return "step"

    def log_likelihood(change, sd):
        return (change / sd) ** 2 / 2 + math.log(sd)

    log_step = log_sum_exp([log_likelihood(*one) for one in step_changes]) - math.log(len(step_changes))
    log_odds = log_step - log_likelihood(*drift_change)
    if abs(log_odds) < math.log(MIN_ODDS):
        return "undecided"
    return "step" if log_odds > 0 else "drift"


def find_change(rows, series, tests):
    """Returns the change of a parameter. p: probability of a false alarm in the whole fleet that is at least as
    significant as the largest step or the drift, whichever is more significant. The kind follows from the likelihoods.
    """
    step_changes, drift_change = list(compute_steps(series)), compute_drift(session_times(rows), series)
    z, k = max((least_z_of_step(series, k), k) for k in range(1, len(series)))
    change, sd = step_changes[k - 1]
    p = 2 * tests["step"] * two_sided_p(z)
    if drift_change:
        p = min(p, 2 * tests["drift"] * two_sided_p(least_z_of_drift(session_times(rows), series)))
    kind = decide_kind(step_changes, drift_change)
    before, since = rows[k - 1], rows[k]
    if kind == "drift":
        (change, sd), before, since = drift_change, rows[0], rows[-1]
    ends = {"before": identify(before), "since": identify(since)}
    return {"kind": kind, "change": change, "sd": sd, "p": min(1.0, p), **ends}


def median_sd(sds):
    """Returns the median sd of a change over a sample of the series; None if there is none. sds: functions."""
    sample = [sd for sd in (compute() for compute in sds[:: 1 + len(sds) // 1000]) if sd]
    return statistics.median(sample) if sample else None


def sd_of_middle_step(series):
    """Returns the sd of a step in the middle of a series, increased for the rejected session; None if no such step is
    tested."""
    half = len(series) // 2
    if half < MIN_SIDE:
        return None
    sd = math.sqrt(sum(1 / sum(1 / sd**2 for _, sd in part) for part in (series[:half], series[half:])))
    return sd * (1 + REJECTION_LOSS["step"] / math.sqrt(len(series)))


def sd_of_drift(times, series):
    """Returns the sd of a drift; None if all times are equal."""
    drift = compute_drift(times, series)
    return drift and drift[1] * (1 + REJECTION_LOSS["drift"] / math.sqrt(len(series)))


def compute_min_detectable(all_series, between, tests):
    """Returns {parameter: {"drift", "step"}} in the unit of the parameter. all_series: (parameter, times, series)."""
    z_detected, rate = NORMAL.inv_cdf(DETECTION_PROBABILITY), FALSE_ALARM_RATE / 4
    z = {kind: z_detected - NORMAL.inv_cdf(rate / max(1, number)) for kind, number in tests.items()}
    found = {}
    for name in (name for name in TRACKED_UNITS if between[name] is not None):
        of_kind = [(times, with_added_sd(series, between[name])) for kind, times, series in all_series if kind == name]
        sds = {"drift": median_sd([lambda of=of: sd_of_drift(*of) for of in of_kind])}
        sds["step"] = median_sd([lambda of=of: sd_of_middle_step(of[1]) for of in of_kind])
        found[name] = {kind: z[kind] * sd for kind, sd in sds.items() if sd}
    return found


def compute_min_detectable_of_lamps(rooms, tau, tests):
    """Returns the smallest detectable step of a lamp in mm, in the middle of its sessions and in any direction."""
    series = [axis for room in rooms for lamp in room.series for axis in room.axis_series(lamp, tau) if len(axis) > 1]
    z = math.sqrt(-2 * math.log(FALSE_ALARM_RATE / 2 / tests["step"])) + NORMAL.inv_cdf(DETECTION_PROBABILITY)
    return {"step": z * median_sd([lambda axis=axis: sd_of_middle_step(axis) for axis in series])}


def negative_significance(change):
    return -abs(change["change"] / change["sd"])


def find_changed_cameras(cameras, between, own, tests):
    alarms = []
    for camera, columns in cameras.items():
        changes = []
        taus = between | own.get(camera, {})
        for column, (rows, series) in columns.items():
            tau = taus.get(parameter_of(column))
            if tau is not None:
                changes.append({"column": column, **find_change(rows, with_added_sd(series, tau), tests)})
        changes = sorted((change for change in changes if change["p"] < FALSE_ALARM_RATE), key=negative_significance)
        if changes:
            alarms.append({"camera": camera, "changes": changes})
    return sorted(alarms, key=lambda alarm: negative_significance(alarm["changes"][0]))


class Room:
    """Lamps of a map over the sessions that detected them."""

    def __init__(self, name, rows):
        self.name = name
        by_session = defaultdict(dict)
        for row in rows:
            by_session[row["camera"], row["session"]][int(row["lamp"])] = row
        by_session = [lamps for lamps in by_session.values() if len(lamps) >= MIN_LAMPS]
        self.sessions = sort_by_date([next(iter(lamps.values())) | {"lamps": lamps} for lamps in by_session])
        self.series = defaultdict(list)  # {lamp: [session, offset as a complex number, sd_x, sd_y]}
        for i, session in enumerate(self.sessions):
            for lamp, row in session["lamps"].items():
                offset = complex(float(row["offset_x_mm"]), float(row["offset_y_mm"]))
                self.series[lamp].append([i, offset, float(row["offset_x_sd_mm"]), float(row["offset_y_sd_mm"])])
        for series in self.series.values():  # the scatter of few captures can be small by chance
            for axis in (2, 3):
                smallest = max(MIN_SD_MM, statistics.median(entry[axis] for entry in series))
                for entry in series:
                    entry[axis] = max(entry[axis], smallest)
        self.influences = {}

    def axis_series(self, lamp, tau=0.0):
        """Returns the series of x and of y: [(value, sd)]."""
        series = self.series[lamp]
        x = [(offset.real, sd) for _, offset, sd, _ in series]
        y = [(offset.imag, sd) for _, offset, _, sd in series]
        return [with_added_sd(x, tau), with_added_sd(y, tau)]

    def squared_differences(self):
        all_series = [series for lamp in self.series for series in self.axis_series(lamp)]
        return [difference for series in all_series for difference in squared_differences(series)]

    def influence(self, session, of, moved):
        """Returns the ratio of the apparent offset of lamp `of` to the displacement of lamp `moved` in a session."""
        lamps = self.sessions[session]["lamps"]
        key = (frozenset(lamps), of, moved)
        if key not in self.influences:
            place = {lamp: complex(float(row["map_x_m"]), float(row["map_y_m"])) for lamp, row in lamps.items()}
            middle = sum(place.values()) / len(place)
            q = {lamp: at - middle for lamp, at in place.items()}
            square = sum(abs(at) ** 2 for at in q.values())
            own = 1 - 1 / len(q) - abs(q[of]) ** 2 / square
            self.influences[key] = (-1 / len(q) - q[of] * q[moved].conjugate() / square) / own if own > 1e-6 else 0
        return self.influences[key]

    def find_largest_step(self, tau):
        """Returns (chi-squared with 2 degrees of freedom, lamp, index in its series, change of x and y, their sds) of
        the most significant step."""
        best = None
        for lamp in sorted(self.series):
            x, y = (compute_steps(series) for series in self.axis_series(lamp, tau))
            axes = self.axis_series(lamp, tau)
            for k, ((dx, sx), (dy, sy)) in enumerate(zip(x, y), 1):
                if best and (dx / sx) ** 2 + (dy / sy) ** 2 <= best[0]:
                    continue
                chi2 = sum(least_z_of_step(axis, k) ** 2 for axis in axes)
                if best is None or chi2 > best[0]:
                    best = (chi2, lamp, k, complex(dx, dy), (sx, sy))
        return best

    def remove_displacement(self, moved, since, change):
        for lamp, series in self.series.items():
            for entry in series:
                session = entry[0]
                if session >= since and moved in self.sessions[session]["lamps"]:
                    entry[1] -= change if lamp == moved else self.influence(session, lamp, moved) * change

    def find_moved_lamps(self, tau, tests):
        found = []
        for _ in range(2 * len(self.series)):
            best = self.find_largest_step(tau)
            if best is None or 2 * tests["step"] * math.exp(-best[0] / 2) >= FALSE_ALARM_RATE:
                break
            chi2, lamp, k, change, sd = best
            before, since = self.series[lamp][k - 1][0], self.series[lamp][k][0]
            common = {row["camera"] for row in self.sessions[:since]} & {row["camera"] for row in self.sessions[since:]}
            ends = {"before": identify(self.sessions[before]), "since": identify(self.sessions[since])}
            values = {"displacement_mm": [change.real, change.imag], "sd_mm": list(sd)}
            values |= {"p": 2 * tests["step"] * math.exp(-chi2 / 2), "other_cameras": not common}
            found.append({"room": self.name[0], "map": self.name[1], "lamp": lamp, **values, **ends})
            self.remove_displacement(lamp, since, change)
        return found


def make_rooms(rows):
    by_room = defaultdict(list)
    for row in rows:
        by_room[row["room"], row["map"]].append(row)
    return [Room(name, room_rows) for name, room_rows in sorted(by_room.items())]


def analyze_fleet(rows, lamp_rows):
    """Returns the section `fleet` of changes.json. rows: of fleet.csv; lamp_rows: of lamps.csv."""
    cameras, rooms = collect_camera_series(rows), make_rooms(lamp_rows)
    of_columns = [(column, *one) for columns in cameras.values() for column, one in columns.items()]
    all_series = [(parameter_of(column), session_times(used), series) for column, used, series in of_columns]
    between = {}
    for name in TRACKED_UNITS:
        of_parameter = [series for parameter, _, series in all_series if parameter == name]
        between[name] = estimate_tau([one for series in of_parameter for one in squared_differences(series)])
    pairs = sum(max(0, len(room.sessions) - 1) for room in rooms)  # the lamps of a session are correlated
    has_enough_pairs = 2 * pairs >= MIN_DIFFERENCES
    tau_mm = estimate_tau([one for room in rooms for one in room.squared_differences()]) if has_enough_pairs else None
    between["lamps"] = tau_mm
    tried = [series for kind, _, series in all_series if between[kind] is not None]
    tests, of_lamps = count_tests(tried), [series for room in rooms for series in room.series.values()]
    tests["step"] += count_tests(of_lamps)["step"] if tau_mm is not None else 0
    min_detectable, moved = compute_min_detectable(all_series, between, tests), []
    if tau_mm is not None:
        min_detectable["lamps"] = compute_min_detectable_of_lamps(rooms, tau_mm, tests)
        moved = [lamp for room in rooms for lamp in room.find_moved_lamps(tau_mm, tests)]
    own = {camera: estimate_camera_taus(columns, between) for camera, columns in cameras.items()}
    own = {camera: taus for camera, taus in own.items() if taus}
    alarms = find_changed_cameras(cameras, between, own, tests)
    found = {"between_sessions": between, "between_sessions_of_camera": own, "min_detectable": min_detectable}
    found |= {"cameras": alarms, "lamps": moved}
    return {"false_alarm_rate": FALSE_ALARM_RATE, "tests": tests, **found}
