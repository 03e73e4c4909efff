# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Says in a few lines what a run over an archive did and how it ended; exit code 1 when a gate is not met, of the
archive or of a session."""
import sys
import time
from pathlib import Path

from changes import load, sessions_beyond_gates
from files import read_table


def this_run(state, sessions):
    ran = {}  # a session may come twice, when a job is submitted again
    for file in sorted((state / "ran").glob("*")):
        for line in file.read_text().splitlines():
            name, *told = line.split("\t")
            ran[name] = told
    failed = sum(verdict in ("no result", "crashed") for verdict, _, _ in ran.values())
    cpu_s = sum(float(cost) for _, cost, _ in ran.values())
    size = sum(int(size) for _, _, size in ran.values())
    seconds = time.time() - float((state / "started").read_text())
    text = f"ran {len(ran)}, of them {failed} without a result; reused {sessions - len(ran)}; "
    return text + f"{seconds:.1f} s, {cpu_s:.1f} s of processor time in the programs, {size / 1e6:.2f} MB written"


def main():
    results = Path(sys.argv[1])
    said = load(results / "changes.json")
    counts, changes, fleet = said["counts"], said["changes"], said["fleet"]
    cost_s = sum(float(row["cpu_s"] or 0) for row in read_table(results / "summary.csv"))
    print(f"this run    {this_run(results / '.state', counts['sessions'])}")
    print(f"passed      {counts['pass']}")
    print(f"look        {counts['look']} that passed with something to look at; the overview begins with them")
    print(f"gates       {counts['gate']} with a result that misses a gate")
    print(f"no result   {counts['no_result']}, and {counts['crashed']} that crashed; see failed/")
    if "median_mm" in counts:
        print(f"error       {counts['median_mm']:.3f} mm in the median session, 90 % below {counts['p90_mm']:.3f} mm")
    print(f"cost        {cost_s:.1f} s of processor time for all results, {cost_s / counts['sessions']:.2f} s a session")
    print(f"fleet       {len(fleet['cameras'])} cameras changed, {len(fleet['lamps'])} lamps were moved")
    if changes:
        print(f"changed     {changes['better']} better, {changes['worse']} worse, {changes['same']} the same,", end=" ")
        print(f"{len(changes['newly_failed'])} newly without a result: {changes.get('verdict', 'nothing to compare')}")
        if changes["other_inputs"]:
            lost = len(changes["lost_with_other_inputs"])
            print(f"inputs      {changes['other_inputs']} of other inputs than before, {lost} lost their result with them")
    print(f"overview    {results / 'overview.html'}")
    for gate in said["gates"]:
        if not gate["passed"]:
            value = "there is no such figure" if gate["value"] is None else f"is {gate['value']:.4g}"
            print(f"reprocess.sh: gate {gate['name']}: {value}, at most {gate['limit']} is asked for", file=sys.stderr)
    if beyond := sessions_beyond_gates(counts, said["gates"]):
        many = f"{beyond} of {counts['sessions']} sessions"
        print(f"reprocess.sh: {many} miss a gate of theirs; how many may, gate_share of --gates says", file=sys.stderr)
    return 0 if said["passed"] else 1


if __name__ == "__main__":
    sys.exit(main())
