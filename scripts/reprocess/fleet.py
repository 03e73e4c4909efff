# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Which cameras changed over their sessions, and which lamps were moved, from fleet.csv and lamps.csv.

A figure's sessions are tried for a step at each session and, of a camera, for a steady drift: the weighted means
before and after, or the slope, in units of their standard deviations; the largest |z| is the change point. The
chance of any false alarm in the whole fleet is FALSE_ALARM_RATE at most: half of it is for drifts and half for
steps, of which there are more, and a p counts as many times as there are tests of its kind (Bonferroni), which
holds however figures go together. Axes of a camera's figures are tested apart, as they do.

A change that is called is a step, a drift or undecided, by the marginal likelihoods of the two models. Both have a mean
and a change with the same wide prior; a step also has a date, with equal prior probability for each of its K sessions:
  step:   mean over k of exp(z_k^2 / 2) sd_k        drift:   exp(z^2 / 2) sd
z and sd are those of the change at session k and of the slope over all sessions. The mean over k is the penalty for the
date. The kind is decided if one likelihood is MIN_ODDS times the other, a posterior probability of 95 % if steps and
drifts are equally frequent. Otherwise it is "undecided", and the change and its date are those of the step.

Stated standard deviations leave out what differs between sessions and not within one (the lens, the map). What
neighboring sessions of the whole fleet differ by more than is stated has a standard deviation between sessions of
its own, tau, for each figure: the variance of a session is sd^2 + tau^2. A factor on the stated ones would take
those that state little for too certain. tau is of the smaller 95 % of the differences, so that the few cameras and
lamps that changed do not hide themselves, and makes deviates smaller by 20 / n for being known from n of them: of
deviates z that are divided by a factor with a relative variance v, exp(z^4 v / 2) times as many are beyond z as of
the true one, which z^2 v / 2 of it makes good, with z = 4.5. v = 2 / n is not derived but chosen on the safe side,
since a few are left out and neighbors go together: of all of n independent ones it would be 1 / (2 n). Of too few
differences nothing is tested.

A camera whose sessions scatter more than those of the fleet has a tau of its own (own_between_sessions()). The test
compares the squares of the differences between neighboring sessions, over all its figures, with those that the tau
of the fleet explains; the largest OWN_REJECTED of a series are left out, so that a change is not taken for scatter. The
own tau has the same safety factor for few differences. Cameras of fewer than MIN_OWN_SESSIONS sessions have the tau of
the fleet, and one that scatters more is called.

`least_found` says what the archive can show: the change of a figure that is called in FOUND_SHARE of cases, as of the
sessions of the median series, a drift or a step in its middle.

A lamp that moves by d is seen d off by the others. As seen by fixes that rest on it, too, lamp i is then
  P_ij d / P_ii,   P = I - 11'/n - q q^H / |q|^2,
off: q are the map's places as complex numbers, less their mean, and what P takes off is the four unknowns of a fix,
a similarity of the floor plan (level camera, lamps of about one height). The lamp with the largest change
is called, its effect on the others is taken off, and they are tried again.
"""
import math
import statistics
from collections import defaultdict

from dates import days_of
from outcome import TWO, sd_of

FALSE_ALARM_RATE = 0.05
FOUND_SHARE = 0.95
NORMAL = statistics.NormalDist()
MIN_ODDS = 19  # of a step to a drift or of a drift to a step, to decide which it is
FEWEST_DIFFERENCES = 20
MOST_DIFFERENCES = 4000  # they determine tau to 1 %
TOLERANCE = 0.01  # of tau^2
KEPT_SHARE = 0.95
VARIANCE_OF_KEPT = 0.7588  # of a normal deviate within 1.96: 1 - 2 * 1.96 phi(1.96) / 0.95
OWN_P = 0.01  # chance that a camera is given a tau of its own without need, which costs sensitivity only
MIN_OWN_SESSIONS = 8
OWN_REJECTED = 2  # largest differences of a series: a step has one, a session with an error two
OWN_VARIANCE_FACTOR = 1.6  # of the sum of squares: neighboring differences share a session (simulated, 8 to 50)
LEAST_SD_MM = 1e-3
WITH_LEVER_ARM = ("zenith", "rotation_center", "dispersion_offset")
FEWEST_LAMPS = 4  # of three a lamp that moved cannot be told


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


def between_sessions(differences):
    """Returns the standard deviation between sessions, tau; None of too few. differences: (square, stated variance)."""
    differences = [one for one in differences if one[0]]
    if len(differences) < FEWEST_DIFFERENCES:
        return None
    some = differences[:: 1 + len(differences) // MOST_DIFFERENCES]
    kept = math.ceil(KEPT_SHARE * len(some))
    return solve_tau([(some, kept)], kept * VARIANCE_OF_KEPT / (1 + 20 / len(some)) ** 2)


def chi2_quantile(p, freedoms):
    """Returns the quantile by the approximation of Wilson and Hilferty."""
    variance = 2 / (9 * freedoms)
    return freedoms * (1 - variance + NORMAL.inv_cdf(p) * math.sqrt(variance)) ** 3


def own_between_sessions(figures, between):
    """Returns {kind of figure: tau} of a camera whose sessions scatter significantly more than those of the fleet, for
    the kinds with a larger tau than the fleet's; {} for other cameras. figures: those of camera_series()."""
    groups, total, expected, count = defaultdict(list), 0.0, defaultdict(float), 0
    for figure, (_, series) in figures.items():
        tau, differences = between.get(kind_of(figure)), neighbors(series)
        if tau is None or len(series) < MIN_OWN_SESSIONS:
            continue
        kept = len(differences) - OWN_REJECTED
        groups[kind_of(figure)].append((differences, kept))
        fraction = (kept + 0.5) / len(differences)  # the cut is between two of them
        expected[kind_of(figure)] += kept * truncated_variance(fraction)
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


def widened(series, tau):
    """The series with what differs between sessions in its standard deviations."""
    return [(value, math.hypot(sd, tau)) for value, sd in series]


def neighbors(series):
    """series: (value, sd). Of neighbors the square of their difference and its stated variance."""
    return [((b - a) ** 2, s**2 + t**2) for (a, s), (b, t) in zip(series, series[1:])]


def steps(series):
    """Of each session but the first: the change there and its sd."""
    weights = [1 / sd**2 for _, sd in series]
    total = sum(weights)
    total_of = sum(weight * value for weight, (value, _) in zip(weights, series))
    before = before_of = 0.0
    for weight, (value, _) in zip(weights[:-1], series):
        before += weight
        before_of += weight * value
        after = total - before
        yield (total_of - before_of) / after - before_of / before, math.sqrt(1 / before + 1 / after)


def drift(times, series):
    """By how much a straight line changes from the first session to the last, and the sd; None in no time."""
    weights = [1 / sd**2 for _, sd in series]
    middle = sum(weight * time for weight, time in zip(weights, times)) / sum(weights)
    spread = sum(weight * (time - middle) ** 2 for weight, time in zip(weights, times))
    span = times[-1] - times[0]
    if not spread > 0:
        return None
    slope = sum(weight * (time - middle) * value for weight, time, (value, _) in zip(weights, times, series)) / spread
    return slope * span, span / math.sqrt(spread)


def p_of(z):
    """Of a normal deviate, both sides."""
    return math.erfc(abs(z) / math.sqrt(2))


def times_of(rows):
    """Days, or, where not all have a date, the sessions' numbers."""
    days = [days_of(row["date"]) for row in rows]
    return list(range(len(rows))) if None in days else days


def in_order(rows):
    """By date, or, where not all have one, by the sessions' names."""
    dated = all(row["date"] for row in rows)
    return sorted(rows, key=lambda row: (row["date"] if dated else "", row["session"], row["camera"]))


def named(row):
    return {"camera": row["camera"], "session": row["session"], "date": row["date"]}


def camera_series(rows):
    """Of each camera, by name: {figure: (rows, [(value, sd)])}, of the sessions that state it. Where a camera has a
    lever arm, a session that found none took it as zero, and has another zenith for that: it does not count."""
    by_camera = defaultdict(list)
    for row in rows:
        by_camera[row["camera"]].append(row)
    found = {}
    for camera, of_it in sorted(by_camera.items()):
        found[camera] = {}
        of_it = in_order(of_it)
        with_arm = [row for row in of_it if row["lever_arm_x_mm"]]
        for name, unit in TWO.items():
            for axis in "xy":
                figure = f"{name}_{axis}_{unit}"
                some = with_arm if with_arm and name in WITH_LEVER_ARM else of_it
                some = [row for row in some if row[figure] and float(row[sd_of(figure)] or 0) > 0]
                if not all(row["date"] for row in of_it):
                    some = in_order(some)  # those without a date may be out
                if len(some) > 1:
                    found[camera][figure] = (some, [(float(row[figure]), float(row[sd_of(figure)])) for row in some])
    return found


def kind_of(figure):
    return figure.rsplit("_", 2)[0]


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


def change_of(rows, series, tests):
    """Returns the change of a figure. p: chance of a false alarm as significant as the more significant of the largest
    step and the drift, anywhere in the fleet. The kind is decided apart from that, by likelihood."""
    step_changes, drift_change = list(steps(series)), drift(times_of(rows), series)
    k, (change, sd) = max(enumerate(step_changes, 1), key=lambda one: abs(one[1][0] / one[1][1]))
    p = 2 * tests["step"] * p_of(change / sd)
    if drift_change:
        p = min(p, 2 * tests["drift"] * p_of(drift_change[0] / drift_change[1]))
    kind = decide_kind(step_changes, drift_change)
    before, since = rows[k - 1], rows[k]
    if kind == "drift":
        (change, sd), before, since = drift_change, rows[0], rows[-1]
    return {"kind": kind, "change": change, "sd": sd, "p": min(1.0, p), "before": named(before), "since": named(since)}


def usual(sds):
    """The median sd of a change, of as many series as are worth the time."""
    some = [sd for sd in (of_one() for of_one in sds[:: 1 + len(sds) // 1000]) if sd]
    return statistics.median(some) if some else None


def sd_in_the_middle(series):
    """Of a step."""
    half = len(series) // 2
    return math.sqrt(sum(1 / sum(1 / sd**2 for _, sd in part) for part in (series[:half], series[half:])))


def least_found_of(of_figures, between, tests):
    """Of each kind of figure that is tried: {"drift", "step"}, in its unit. of_figures: (kind, times, series)."""
    z = {kind: NORMAL.inv_cdf(FOUND_SHARE) - NORMAL.inv_cdf(FALSE_ALARM_RATE / 4 / max(1, tests[kind])) for kind in tests}
    found = {}
    for name in (name for name in TWO if between[name] is not None):
        of_kind = [(times, widened(series, between[name])) for kind, times, series in of_figures if kind == name]
        sds = {"drift": usual([lambda of=of: (drift(*of) or (0, None))[1] for of in of_kind])}
        sds["step"] = usual([lambda of=of: sd_in_the_middle(of[1]) for of in of_kind])
        found[name] = {kind: z[kind] * sd for kind, sd in sds.items() if sd}
    return found


def least_found_of_lamps(rooms, tau, tests):
    """In mm: a step in the middle, whatever its direction."""
    series = [one for room in rooms for lamp in room.series for one in room.along(lamp, tau) if len(one) > 1]
    z = math.sqrt(-2 * math.log(FALSE_ALARM_RATE / 2 / tests["step"])) + NORMAL.inv_cdf(FOUND_SHARE)
    return {"step": z * usual([lambda one=one: sd_in_the_middle(one) for one in series])}


def smallness(change):
    return -abs(change["change"] / change["sd"])


def changed_cameras(cameras, between, own, tests):
    alarms = []
    for camera, figures in cameras.items():
        changes = []
        taus = between | own.get(camera, {})
        for figure, (rows, series) in figures.items():
            tau = taus.get(kind_of(figure))
            if tau is not None:
                changes.append({"figure": figure, **change_of(rows, widened(series, tau), tests)})
        changes = sorted((one for one in changes if one["p"] < FALSE_ALARM_RATE), key=smallness)
        if changes:
            alarms.append({"camera": camera, "changes": changes})
    return sorted(alarms, key=lambda alarm: smallness(alarm["changes"][0]))


class Room:
    """The lamps of a map over the sessions that were taken under them."""

    def __init__(self, name, rows):
        self.name = name
        by_session = defaultdict(dict)
        for row in rows:
            by_session[row["camera"], row["session"]][int(row["lamp"])] = row
        by_session = [lamps for lamps in by_session.values() if len(lamps) >= FEWEST_LAMPS]
        self.sessions = in_order([next(iter(lamps.values())) | {"lamps": lamps} for lamps in by_session])
        self.series = defaultdict(list)  # of a lamp: [session, place off as a complex number, sd_x, sd_y]
        for i, session in enumerate(self.sessions):
            for lamp, row in session["lamps"].items():
                off = complex(float(row["offset_x_mm"]), float(row["offset_y_mm"]))
                self.series[lamp].append([i, off, float(row["offset_x_sd_mm"]), float(row["offset_y_sd_mm"])])
        for series in self.series.values():  # of few captures a scatter is small by chance
            for axis in (2, 3):
                usual = max(LEAST_SD_MM, statistics.median(one[axis] for one in series))
                for one in series:
                    one[axis] = max(one[axis], usual)
        self.shares = {}

    def along(self, lamp, tau=0.0):
        """Of x and of y: [(value, sd)]."""
        series = self.series[lamp]
        x = [(one[1].real, one[2]) for one in series]
        return [widened(x, tau), widened([(one[1].imag, one[3]) for one in series], tau)]

    def differences(self):
        return [one for lamp in self.series for series in self.along(lamp) for one in neighbors(series)]

    def tests(self):
        return sum(len(series) - 1 for series in self.series.values())

    def share(self, session, of, moved):
        """By how much of a lamp's movement the fixes of a session see another one off."""
        lamps = self.sessions[session]["lamps"]
        key = (frozenset(lamps), of, moved)
        if key not in self.shares:
            place = {lamp: complex(float(row["map_x_m"]), float(row["map_y_m"])) for lamp, row in lamps.items()}
            middle = sum(place.values()) / len(place)
            q = {lamp: at - middle for lamp, at in place.items()}
            square = sum(abs(at) ** 2 for at in q.values())
            own = 1 - 1 / len(q) - abs(q[of]) ** 2 / square
            self.shares[key] = (-1 / len(q) - q[of] * q[moved].conjugate() / square) / own if own > 1e-6 else 0
        return self.shares[key]

    def largest(self, tau):
        """(chi-squared of 2 degrees, lamp, number in its series, change in x and y, their sd) of the change point."""
        best = None
        for lamp in sorted(self.series):
            x, y = (steps(series) for series in self.along(lamp, tau))
            for k, ((dx, sx), (dy, sy)) in enumerate(zip(x, y), 1):
                chi2 = (dx / sx) ** 2 + (dy / sy) ** 2
                if best is None or chi2 > best[0]:
                    best = (chi2, lamp, k, complex(dx, dy), (sx, sy))
        return best

    def take_off(self, moved, since, change):
        for lamp, series in self.series.items():
            for one in series:
                if one[0] >= since and moved in self.sessions[one[0]]["lamps"]:
                    one[1] -= change if lamp == moved else self.share(one[0], lamp, moved) * change

    def moved(self, tau, tests):
        found = []
        for _ in range(2 * len(self.series)):
            best = self.largest(tau)
            if best is None or 2 * tests["step"] * math.exp(-best[0] / 2) >= FALSE_ALARM_RATE:
                break
            chi2, lamp, k, change, sd = best
            before, since = self.series[lamp][k - 1][0], self.series[lamp][k][0]
            alike = {row["camera"] for row in self.sessions[:since]} & {row["camera"] for row in self.sessions[since:]}
            ends = {"before": named(self.sessions[before]), "since": named(self.sessions[since])}
            figures = {"moved_mm": [change.real, change.imag], "sd_mm": list(sd)}
            figures |= {"p": 2 * tests["step"] * math.exp(-chi2 / 2), "other_cameras": not alike}
            found.append({"room": self.name[0], "map": self.name[1], "lamp": lamp, **figures, **ends})
            self.take_off(lamp, since, change)
        return found


def rooms_of(rows):
    by_room = defaultdict(list)
    for row in rows:
        by_room[row["room"], row["map"]].append(row)
    return [Room(name, of_it) for name, of_it in sorted(by_room.items())]


def fleet_of(rows, lamp_rows):
    """What changed, for changes.json: rows of fleet.csv and of lamps.csv."""
    cameras, rooms = camera_series(rows), rooms_of(lamp_rows)
    of_figures = [
        (kind_of(figure), times_of(of_it), series)
        for figures in cameras.values()
        for figure, (of_it, series) in figures.items()
    ]
    between = {}
    for name in TWO:
        of_name = [one for kind, _, series in of_figures if kind == name for one in neighbors(series)]
        between[name] = between_sessions(of_name)
    pairs = sum(max(0, len(room.sessions) - 1) for room in rooms)  # the lamps of a session go together
    enough = 2 * pairs >= FEWEST_DIFFERENCES
    tau_mm = between_sessions([one for room in rooms for one in room.differences()]) if enough else None
    between["lamps"] = tau_mm
    tried = [series for kind, _, series in of_figures if between[kind] is not None]
    tests = {"drift": len(tried), "step": sum(len(series) - 1 for series in tried)}
    if tau_mm is not None:
        tests["step"] += sum(room.tests() for room in rooms)
    least_found = least_found_of(of_figures, between, tests)
    moved = []
    if tau_mm is not None:
        least_found["lamps"] = least_found_of_lamps(rooms, tau_mm, tests)
        moved = [lamp for room in rooms for lamp in room.moved(tau_mm, tests)]
    own = {camera: own_between_sessions(figures, between) for camera, figures in cameras.items()}
    own = {camera: taus for camera, taus in own.items() if taus}
    alarms = changed_cameras(cameras, between, own, tests)
    found = {"between_sessions": between, "own_between_sessions": own, "least_found": least_found}
    found |= {"cameras": alarms, "lamps": moved}
    return {"false_alarm_rate": FALSE_ALARM_RATE, "tests": tests, **found}
