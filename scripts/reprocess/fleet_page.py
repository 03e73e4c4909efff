# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Section of the overview on changes of cameras and lamps over time."""
import pictures
from changes import describe_date
from fleet import collect_camera_series, parameter_of, make_rooms, session_times, with_added_sd
from pictures import picture, table
from outcome import TRACKED_UNITS

MAX_PLOTS = 12


def describe_session(end):
    return f"{end['camera']}/{end['session']}" + (f" of {end['date']}" if end["date"] else "")


def describe_room(lamp):
    return f"{lamp['room']} (map {lamp['map']})" if lamp["room"] else f"map {lamp['map']}"


def format_probability(p):
    return f"{p:.2g}" if p >= 1e-9 else "below 1e-9"


def cameras(fleet, fleet_rows):
    html, rows = '<h2 id="cameras">Cameras that changed</h2>\n', []
    for alarm in fleet["cameras"]:
        for change in alarm["changes"]:
            name, axis, unit = change["column"].rsplit("_", 2)
            words = f"{name.replace('_', ' ')} {axis} ({unit})", f"{change['change']:+.4g} ± {change['sd']:.2g}"
            rows.append((alarm["camera"], *words, describe_date(change), format_probability(change["p"])))
    html += table(["camera", "parameter", "change", "step or drift", "false alarm probability"], rows, "changes.json")
    pictured = {alarm["camera"] for alarm in fleet["cameras"][:MAX_PLOTS]}
    series = collect_camera_series([row for row in fleet_rows if row["camera"] in pictured])
    for alarm in fleet["cameras"][:MAX_PLOTS]:
        columns, first = series[alarm["camera"]], alarm["changes"][0]
        name, points = parameter_of(first["column"]), {}
        rows_of_first = columns[first["column"]][0]
        times = session_times(rows_of_first)
        tau = fleet["between_sessions_of_camera"].get(alarm["camera"], {}).get(name, fleet["between_sessions"][name])
        for axis in "xy":  # relative to the first session, so that both axes fit one plot
            used, values = columns.get(f"{name}_{axis}_{TRACKED_UNITS[name]}", ([], []))
            widened = with_added_sd(values, tau)
            points[axis] = [(t, value - values[0][0], sd) for t, (value, sd) in zip(session_times(used), widened)]
        since = first["since"]["session"] if first["kind"] != "drift" else None
        at = next((time for time, row in zip(times, rows_of_first) if row["session"] == since), None)
        dated = all(row["date"] for row in rows_of_first)
        what = f"{name.replace('_', ' ')} from the first session ({TRACKED_UNITS[name]})"
        drawn = pictures.over_time(points, f"change ({TRACKED_UNITS[name]})", dated, at)
        html += picture(drawn, f"{alarm['camera']}: {what}")
    return html


def lamps(fleet, lamp_rows):
    html, rows = '<h2 id="lamps">Lamps that were moved</h2>\n', []
    for lamp in fleet["lamps"]:
        x_mm, y_mm = lamp["displacement_mm"]
        by = f"{abs(complex(x_mm, y_mm)):.2f} mm: x {x_mm:+.2f}, y {y_mm:+.2f}"
        sure = "different cameras before and after: they may be the cause" if lamp["other_cameras"] else ""
        ends = describe_session(lamp["before"]), describe_session(lamp["since"])
        rows.append((describe_room(lamp), lamp["lamp"], by, *ends, format_probability(lamp["p"]), sure))
    columns = ["room", "lamp", "moved by", "after", "not later than", "false alarm probability", ""]
    html += table(columns, rows, "changes.json")
    pictured = {(lamp["room"], lamp["map"]) for lamp in fleet["lamps"][:MAX_PLOTS]}
    pictured_rows = [row for row in lamp_rows if (row["room"], row["map"]) in pictured]
    rooms = {room.name: room for room in make_rooms(pictured_rows)}
    for lamp in fleet["lamps"][:MAX_PLOTS]:
        room = rooms[lamp["room"], lamp["map"]]
        times, numbers = session_times(room.sessions), [entry[0] for entry in room.series[lamp["lamp"]]]
        all_series = zip("xy", room.axis_series(lamp["lamp"], fleet["between_sessions"]["lamps"]))
        points = {axis: [(times[i], *one) for i, one in zip(numbers, series)] for axis, series in all_series}
        is_since = [all(row[key] == lamp["since"][key] for key in ("camera", "session")) for row in room.sessions]
        what = f"lamp {lamp['lamp']}: position relative to the other lamps minus the map (mm)"
        dated = all(row["date"] for row in room.sessions)
        drawn = pictures.over_time(points, "offset (mm)", dated, times[is_since.index(True)])
        html += picture(drawn, f"{describe_room(lamp)}: {what}")
    return html


def list_scattering_cameras(fleet):
    """Renders the table of cameras whose sessions scatter more than those of the fleet."""
    if not fleet["between_sessions_of_camera"]:
        return ""
    rows = []
    for camera, taus in sorted(fleet["between_sessions_of_camera"].items()):
        for name, tau in taus.items():
            words = f"{name.replace('_', ' ')} ({TRACKED_UNITS[name]})"
            rows.append((camera, words, f"{tau:.2g}", f"{fleet['between_sessions'][name]:.2g}"))
    html = "<h2>Cameras whose sessions scatter more than those of the fleet</h2>\n"
    columns = ["camera", "parameter", "standard deviation between sessions", "fleet"]
    return html + table(columns, rows, "changes.json")


def min_detectable(fleet):
    html = "<p>Smallest changes that are detected in 95 % of cases:</p>\n"
    rows = []
    for name, sizes in fleet["min_detectable"].items():
        words = f"{name.replace('_', ' ')} ({TRACKED_UNITS.get(name, 'mm')})"
        rows.append((words, *(f"{sizes[kind]:.2g}" if kind in sizes else "" for kind in ("drift", "step"))))
    return html + table(["", "drift, from the first session to the last", "step, in the middle"], rows)


def render_page(fleet, fleet_rows, lamp_rows):
    html = cameras(fleet, fleet_rows) if fleet["cameras"] else ""
    html += lamps(fleet, lamp_rows) if fleet["lamps"] else ""
    tested = {name: tau for name, tau in fleet["between_sessions"].items() if tau is not None}
    if not tested:
        return html + "<p>Too few sessions of a camera or of a room to test for changes of cameras or lamps.</p>\n"
    if not html:
        html = "<h2>Cameras and lamps over time</h2>\n<p>No change of a camera or lamp was detected.</p>\n"
    added = ((name, tau) for name, tau in tested.items() if tau)
    wide = ", ".join(f"{name.replace('_', ' ')} {tau:.2g} {TRACKED_UNITS.get(name, 'mm')}" for name, tau in added)
    rate = f"{100 * fleet['false_alarm_rate']:.0f} %"
    drifts, steps = fleet["tests"]["drift"], fleet["tests"]["step"]
    html += f"<p>{drifts} parameters were tested for drifts, {steps} sessions of parameters and lamps for steps; the "
    html += f"probability of any false alarm is at most {rate}."
    if wide:
        html += " Sessions differ by more than the reported uncertainties. "
        html += f"The tests include an additional standard deviation between sessions: {wide}."
    return html + " All values: fleet.csv, lamps.csv.</p>\n" + list_scattering_cameras(fleet) + min_detectable(fleet)
