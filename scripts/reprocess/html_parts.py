# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""HTML elements of the overview."""
from html import escape

MAX_ROWS = 200  # of a table


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
