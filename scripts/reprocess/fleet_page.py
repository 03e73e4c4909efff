# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""The overview's part about cameras and lamps over time."""
import pictures
from changes import describe_date
from fleet import camera_series, kind_of, rooms_of, times_of, widened
from html_parts import picture, table
from outcome import TWO

MOST_PICTURES = 12


def words_of(figure):
    """ "focal_x_px" as "focal x (px)"."""
    name, axis, unit = figure.rsplit("_", 2)
    return f"{name.replace('_', ' ')} {axis} ({unit})"


def when(end):
    return f"{end['camera']}/{end['session']}" + (f" of {end['date']}" if end["date"] else "")


def room_of(lamp):
    return f"{lamp['room']} (map {lamp['map']})" if lamp["room"] else f"map {lamp['map']}"


def chance(p):
    return f"{p:.2g}" if p >= 1e-9 else "below 1e-9"


def cameras(fleet, fleet_rows):
    html, rows = '<h2 id="cameras">Cameras that changed</h2>\n', []
    for alarm in fleet["cameras"]:
        for change in alarm["changes"]:
            by = f"{change['change']:+.4g} ± {change['sd']:.2g}"
            rows.append((alarm["camera"], words_of(change["figure"]), by, describe_date(change), chance(change["p"])))
    html += table(["camera", "parameter", "change", "step or drift", "false alarm probability"], rows, "changes.json")
    pictured = {alarm["camera"] for alarm in fleet["cameras"][:MOST_PICTURES]}
    series = camera_series([row for row in fleet_rows if row["camera"] in pictured])
    for alarm in fleet["cameras"][:MOST_PICTURES]:
        figures, first = series[alarm["camera"]], alarm["changes"][0]
        name, points = kind_of(first["figure"]), {}
        of_it = figures[first["figure"]][0]
        times = times_of(of_it)
        tau = fleet["own_between_sessions"].get(alarm["camera"], {}).get(name, fleet["between_sessions"][name])
        for axis in "xy":  # from the first session, so that both are seen
            rows_of_it, one = figures.get(f"{name}_{axis}_{TWO[name]}", ([], []))
            wide = widened(one, tau)
            points[axis] = [(t, value - one[0][0], sd) for t, (value, sd) in zip(times_of(rows_of_it), wide)]
        since = first["since"]["session"] if first["kind"] != "drift" else None
        at = next((time for time, row in zip(times, of_it) if row["session"] == since), None)
        dated = all(row["date"] for row in of_it)
        what = f"{name.replace('_', ' ')} from the first session ({TWO[name]})"
        html += picture(pictures.over_time(points, f"change ({TWO[name]})", dated, at), f"{alarm['camera']}: {what}")
    return html


def lamps(fleet, lamp_rows):
    html, rows = '<h2 id="lamps">Lamps that were moved</h2>\n', []
    for lamp in fleet["lamps"]:
        by = f"{abs(complex(*lamp['moved_mm'])):.2f} mm: x {lamp['moved_mm'][0]:+.2f}, y {lamp['moved_mm'][1]:+.2f}"
        sure = "different cameras before and after: they may be the cause" if lamp["other_cameras"] else ""
        ends = when(lamp["before"]), when(lamp["since"])
        rows.append((room_of(lamp), lamp["lamp"], by, *ends, chance(lamp["p"]), sure))
    columns = ["room", "lamp", "moved by", "after", "not later than", "false alarm probability", ""]
    html += table(columns, rows, "changes.json")
    pictured = {(lamp["room"], lamp["map"]) for lamp in fleet["lamps"][:MOST_PICTURES]}
    rooms = {room.name: room for room in rooms_of([row for row in lamp_rows if (row["room"], row["map"]) in pictured])}
    for lamp in fleet["lamps"][:MOST_PICTURES]:
        room = rooms[lamp["room"], lamp["map"]]
        times, numbers = times_of(room.sessions), [one[0] for one in room.series[lamp["lamp"]]]
        points = {
            axis: [(times[i], value, sd) for i, (value, sd) in zip(numbers, series)]
            for axis, series in zip("xy", room.along(lamp["lamp"], fleet["between_sessions"]["lamps"]))
        }
        is_since = [all(row[key] == lamp["since"][key] for key in ("camera", "session")) for row in room.sessions]
        what = f"lamp {lamp['lamp']}: position relative to the other lamps minus the map (mm)"
        dated = all(row["date"] for row in room.sessions)
        drawn = pictures.over_time(points, "offset (mm)", dated, times[is_since.index(True)])
        html += picture(drawn, f"{room_of(lamp)}: {what}")
    return html


def own_scatter(fleet):
    """The cameras whose sessions scatter more than those of the fleet."""
    if not fleet["own_between_sessions"]:
        return ""
    rows = []
    for camera, taus in sorted(fleet["own_between_sessions"].items()):
        for name, tau in taus.items():
            words = f"{name.replace('_', ' ')} ({TWO[name]})"
            rows.append((camera, words, f"{tau:.2g}", f"{fleet['between_sessions'][name]:.2g}"))
    html = "<h2>Cameras whose sessions scatter more than those of the fleet</h2>\n"
    columns = ["camera", "parameter", "standard deviation between sessions", "fleet"]
    return html + table(columns, rows, "changes.json")


def least_found(fleet):
    html = "<p>Smallest changes that are detected in 95 % of cases:</p>\n"
    rows = []
    for name, sizes in fleet["least_found"].items():
        words = f"{name.replace('_', ' ')} ({TWO.get(name, 'mm')})"
        rows.append((words, *(f"{sizes[kind]:.2g}" if kind in sizes else "" for kind in ("drift", "step"))))
    return html + table(["", "drift, from the first session to the last", "step, in the middle"], rows)


def page(fleet, fleet_rows, lamp_rows):
    html = cameras(fleet, fleet_rows) if fleet["cameras"] else ""
    html += lamps(fleet, lamp_rows) if fleet["lamps"] else ""
    tested = {name: tau for name, tau in fleet["between_sessions"].items() if tau is not None}
    if not tested:
        return html + "<p>Too few sessions of a camera or of a room to test for changes of cameras or lamps.</p>\n"
    if not html:
        html = "<h2>Cameras and lamps over time</h2>\n"
        html += "<p>No change of a camera or lamp was detected.</p>\n"
    wide = ", ".join(f"{name.replace('_', ' ')} {tau:.2g} {TWO.get(name, 'mm')}" for name, tau in tested.items() if tau)
    rate = f"{100 * fleet['false_alarm_rate']:.0f} %"
    drifts, steps = fleet["tests"]["drift"], fleet["tests"]["step"]
    html += f"<p>{drifts} parameters were tested for drifts, {steps} sessions of parameters and lamps for steps; the "
    html += f"probability of any false alarm is at most {rate}."
    if wide:
        html += " Sessions differ by more than the reported uncertainties. "
        html += f"The tests include an additional standard deviation between sessions: {wide}."
    return html + " All values: fleet.csv, lamps.csv.</p>\n" + own_scatter(fleet) + least_found(fleet)
