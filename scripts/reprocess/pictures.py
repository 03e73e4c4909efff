# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""HTML elements of the overview; its plots, rendered by gnuplot, as data URLs for <img>."""
import base64
import subprocess
from html import escape

BEFORE, NOW = "#E69F00", "#0072B2"  # from the palette of Okabe and Ito
MAX_POINTS = 4000
MAX_ROWS = 200  # of a table
BETWEEN = "(0.02, 0.05, 0.2, 0.5, 2, 5, 20, 50, 200, 500)"  # marks on logarithmic axes


def render(script, size="640,420"):
    head = f"set terminal svg size {size} font 'sans,14' background 'white'\nset grid lc rgb '#cccccc'\n"
    run = subprocess.run(["gnuplot"], input=(head + script).encode(), capture_output=True, check=True)
    return "data:image/svg+xml;base64," + base64.b64encode(run.stdout).decode()


def block(name, points):
    """Formats a data block of gnuplot. A long one is thinned out evenly."""
    step = max(1, -(-len(points) // MAX_POINTS))
    lines = [" ".join(f"{number:.6g}" for number in point) for point in points[::step]]
    return f"${name} << END\n" + "\n".join(lines) + "\nEND\n"


def cumulative_fractions(values):
    values = sorted(values)
    return [(value, (i + 1) / len(values)) for i, value in enumerate(values)]


def distribution(now, before):
    script = block("now", cumulative_fractions(now)) + "set xlabel 'mean horizontal error of a session (mm)'\n"
    script += "set ylabel 'fraction of the sessions'\nset yrange [0:1]\nset key bottom right\nset logscale x\n"
    script += f"set xtics add {BETWEEN}\n"
    plots = [f"$now using 1:2 with lines lw 2 lc rgb '{NOW}' title 'now'"]
    if before:
        script += block("before", cumulative_fractions(before))
        plots.insert(0, f"$before using 1:2 with lines lw 2 dt 2 lc rgb '{BEFORE}' title 'before'")
    return render(script + "plot " + ", ".join(plots) + "\n")


def over_time(series, words, dated, since=None):
    """series: {name: [(time, value, sd)]}; days since 1970 where they are dated; since: where the change is."""
    script = f"set ylabel '{words}'\nset offsets graph 0.05, 0.05, 0.1, 0.1\nset key top left\n"
    if dated:
        script += "set xdata time\nset timefmt '%s'\nset format x '%Y-%m'\nset xtics rotate by -30\n"
        script += "set rmargin 5\n"
    else:
        script += "set xlabel 'session'\n"
    day_s = 86400 if dated else 1
    if since is not None:
        at = f"'{since * day_s:.0f}'" if dated else f"{since}"
        script += f"set arrow from {at}, graph 0 to {at}, graph 1 nohead dt 2 lc rgb '#888888'\n"
    plots = []
    for number, (name, points) in enumerate(series.items()):
        lines = "\n".join(f"{time * day_s:.0f} {value:.8g} {sd:.6g}" for time, value, sd in points)
        script += f"$series{number} << END\n{lines}\nEND\n"
        style = f"with yerrorbars pt 7 ps 0.5 lc rgb '{(NOW, BEFORE)[number % 2]}' title '{name}'"
        plots.append(f"$series{number} using 1:2:3 {style}")
    return render(script + "plot " + ", ".join(plots) + "\n", "640,320")


def table(columns, rows, where="summary.csv"):
    head = "".join(f'<th scope="col">{escape(column)}</th>' if column else "<td></td>" for column in columns)
    cells = ["".join(f"<td>{escape(str(cell))}</td>" for cell in row) for row in rows[:MAX_ROWS]]
    body = "".join(f"<tr>{row}</tr>\n" for row in cells)
    more = f"<p>and {len(rows) - MAX_ROWS} more, in {where}</p>" if len(rows) > MAX_ROWS else ""
    scrolled = '<div class="wide" tabindex="0" role="region" aria-label="Table">'
    return f"{scrolled}<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table></div>{more}\n"


def picture(data, words):
    return f'<p><img src="{data}" alt="{escape(words)}"></p><p>{escape(words)}</p>\n'


def number(value):
    return f"{value:.4g}" if isinstance(value, float) else "none" if value is None else str(value)
