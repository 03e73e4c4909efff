# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Joins the rows of the shards, in RESULTS, applies --session-gates, and writes summary.csv (a row per session),
fleet.csv (a row per session with a calibration) and lamps.csv (a row per session and lamp: its position relative to
the other lamps)."""
import gc
import json
import re
from pathlib import Path

from files import read_table, table, write_atomically
from outcome import SUMMARY_COLUMNS, FLEET_COLUMNS, LAMP_COLUMNS
from plausibility import count_inputs, find_suspects, format_counts, session_name
from session_gates import apply_session_gates


def make_lamp_rows(row):
    for lamp in json.loads(row["lamps"]) if row["lamps"] else []:
        offsets = {"lamp": lamp["lamp"], "captures": lamp["captures"]}
        for i, axis in enumerate("xy"):
            offsets[f"map_{axis}_m"] = f"{lamp['map_m'][i]:.6g}"
            offsets[f"offset_{axis}_mm"] = f"{lamp['offset_mm'][i]:.6g}"
            offsets[f"offset_{axis}_sd_mm"] = f"{lamp['offset_sd_mm'][i]:.6g}"
        yield row | offsets


def read_costs(folder):
    """Returns the processor time of the last result of each session as text. Sessions are missing if .state was removed
    since."""
    costs = {}
    for file in filter(Path.is_file, folder.glob("*")):
        for line in file.read_text().splitlines():
            # A killed process may leave an incomplete line.
            if whole := re.fullmatch(r"([^\t]+)\t([\d.]+)\t(\d+\.\d{3})", line):
                name, cost, at = whole.groups()
                costs[name] = max(costs.get(name, (0, "")), (float(at), cost))
    return {name: cost for name, (_, cost) in costs.items()}


def main():
    shards = sorted(file.stem for file in Path(".state/shards").glob("*.list"))
    stated = {(row["camera"], row["session"]): row for row in read_table(".state/dates.csv")}
    rows = [row for shard in shards for row in read_table(f".state/rows/{shard}.csv")]
    costs = read_costs(Path(".state/costs"))
    limits = json.loads(Path(".state/session_gates.json").read_text())
    rows.sort(key=lambda row: (row["camera"], row["session"]))
    for row in rows:
        apply_session_gates(row, limits)
        known = stated.get((row["camera"], row["session"]), {"date": "", "room": "", "files": ""})
        row |= {"date": known["date"], "room": known["room"]}
        row["expected"] = format_counts(count_inputs(row["expected"]) | count_inputs(known["files"]))
        row["cpu_s"] = costs.get(f"{row['camera']}/{row['session']}", "")
    suspects = find_suspects(rows)
    for row in rows:
        row["suspect"] = "; ".join(suspects[session_name(row)])
        row["verdict"] = "review" if row["suspect"] and row["verdict"] == "pass" else row["verdict"]
    calibrated = [row for row in rows if row["focal_x_px"]]
    write_atomically("lamps.csv", table(LAMP_COLUMNS, (lamp for row in calibrated for lamp in make_lamp_rows(row))))
    write_atomically("fleet.csv", table(FLEET_COLUMNS, calibrated))
    write_atomically("summary.csv", table(SUMMARY_COLUMNS, rows))


if __name__ == "__main__":
    gc.disable()  # saves time: the many rows of an archive have no reference cycles
    main()
