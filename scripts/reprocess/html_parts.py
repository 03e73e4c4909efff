# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Parts of the overview."""
from html import escape

MOST_ROWS = 200  # of a table


def table(columns, rows, where="summary.csv"):
    head = "".join(f'<th scope="col">{escape(column)}</th>' if column else "<td></td>" for column in columns)
    cells = ["".join(f"<td>{escape(str(cell))}</td>" for cell in row) for row in rows[:MOST_ROWS]]
    body = "".join(f"<tr>{row}</tr>\n" for row in cells)
    more = f"<p>and {len(rows) - MOST_ROWS} more, in {where}</p>" if len(rows) > MOST_ROWS else ""
    scrolled = '<div class="wide" tabindex="0" role="region" aria-label="Table">'
    return f"{scrolled}<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table></div>{more}\n"


def picture(data, words):
    return f'<p><img src="{data}" alt="{escape(words)}"></p><p>{escape(words)}</p>\n'


def number(value):
    return f"{value:.4g}" if isinstance(value, float) else "none" if value is None else str(value)
