# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Joins the rows of the shards, in RESULTS, applies --session-gates, and writes summary.csv (a row per session),
fleet.csv (a row per session with a calibration: its metrics over time) and lamps.csv (a row per session and lamp: its
position according to the other lamps)."""
import gc
import json
import re
from pathlib import Path

from files import read_table, table, write_whole
from outcome import COLUMNS, FLEET, LAMPS
from session_gates import apply_session_gates


def lamps_of(row):
    for lamp in json.loads(row["lamps"]) if row["lamps"] else []:
        figures = {"lamp": lamp["lamp"], "captures": lamp["captures"]}
        for i, axis in enumerate("xy"):
            figures[f"map_{axis}_m"] = f"{lamp['map_m'][i]:.6g}"
            figures[f"offset_{axis}_mm"] = f"{lamp['offset_mm'][i]:.6g}"
            figures[f"offset_{axis}_sd_mm"] = f"{lamp['offset_sd_mm'][i]:.6g}"
        yield row | figures


def costs_in(folder):
    """Of each session the processor time of its last result, as text; of none when .state was taken away since."""
    costs = {}
    for file in filter(Path.is_file, folder.glob("*")):
        for line in file.read_text().splitlines():
            if whole := re.fullmatch(r"([^\t]+)\t([\d.]+)\t(\d+\.\d{3})", line):  # some may be cut off by a kill
                name, cost, at = whole.groups()
                costs[name] = max(costs.get(name, (0, "")), (float(at), cost))
    return {name: cost for name, (_, cost) in costs.items()}


def main():
    shards = sorted(file.stem for file in Path(".state/shards").glob("*.list"))
    stated = {(row["camera"], row["session"]): row for row in read_table(".state/dates.csv")}
    rows = [row for shard in shards for row in read_table(f".state/rows/{shard}.csv")]
    costs = costs_in(Path(".state/costs"))
    limits = json.loads(Path(".state/session_gates.json").read_text())
    rows.sort(key=lambda row: (row["camera"], row["session"]))
    for row in rows:
        apply_session_gates(row, limits)
        known = stated.get((row["camera"], row["session"]), {"date": "", "room": ""})
        row |= {"date": known["date"], "room": known["room"]}
        row["cpu_s"] = costs.get(f"{row['camera']}/{row['session']}", "")
    calibrated = [row for row in rows if row["focal_x_px"]]
    write_whole("lamps.csv", table(LAMPS, (lamp for row in calibrated for lamp in lamps_of(row))))
    write_whole("fleet.csv", table(FLEET, calibrated))
    write_whole("summary.csv", table(COLUMNS, rows))


if __name__ == "__main__":
    gc.disable()  # of an archive's many rows none go in circles
    main()
