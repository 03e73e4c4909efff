# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Page in place of overview.html while a run has not ended: verdict INCOMPLETE, and which results are of which run. The
overview of the last complete run is in .state/overview.html. Snakemake makes a new one if results changed; otherwise
restore() puts the last one back. The page is older than these results, or changes.json is."""
import os
import sys
import time
from html import escape
from pathlib import Path

MARK = "<!-- run that has not ended -->"


def is_run_page(page):
    return page.exists() and MARK in page.read_text()


def write(results):
    page, last, state = results / "overview.html", results / ".state/overview.html", results / ".state"
    if page.exists() and not is_run_page(page):
        os.replace(page, last)
    ran = {line.split("\t")[0] for file in (state / "ran").glob("*") for line in file.read_text().splitlines()}
    text = f'<!DOCTYPE html>\n<meta charset="utf-8"><title>Incomplete run</title>{MARK}\n'
    text += '<p class="verdict">INCOMPLETE</p>\n'
    began, form = float((state / "started").read_text()), "%Y-%m-%d %H:%M:%S UTC"
    text += f"<p>The run that began on {time.strftime(form, time.gmtime(began))} has not ended; the same command "
    text += f"continues it. Results of this run: {escape(', '.join(sorted(ran))) or 'none'}.</p>\n"
    if last.exists():
        until = time.strftime(form, time.gmtime(last.stat().st_mtime))
        text += f"<p>All other results, summary.csv and changes.json are of runs up to {until}.</p>\n"
    page.write_text(text)


def restore(results):
    if is_run_page(results / "overview.html"):
        os.replace(results / ".state/overview.html", results / "overview.html")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
