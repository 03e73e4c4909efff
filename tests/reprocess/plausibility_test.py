#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Sessions that are not plausible: copies, lost inputs, unusual metrics, inputs of another camera."""
import random
import unittest

import parts  # noqa: F401
import plausibility


def fleet(cameras, seed=1):
    """Returns rows with the scatter of datasets/archive, two sessions of each camera."""
    chance, rows = random.Random(seed), []
    for camera in range(cameras):
        lens = [chance.gauss(260, 2), chance.gauss(260, 2), chance.gauss(200, 2), chance.gauss(150, 2)]
        center = [chance.gauss(200, 4), chance.gauss(150, 4)]
        for session in "12":
            row = {"camera": f"c{camera}", "session": session, "inputs": f"{camera} {session}"}
            for metric in ("mean_mm", "height_rms_mm", "yaw_rms_deg", "dispersion_mm", "normalized_error_rms"):
                row[metric] = str(0.3 * chance.lognormvariate(0, 0.4))
            row |= {"mtf50": str(chance.gauss(0.283, 0.001)), "rms_px": "0.011", "rotation_px": "0.011"}
            for columns, values, sd in ((plausibility.IDENTIFYING["boards"], lens, 0.02), (plausibility.IDENTIFYING["rotation"], center, 0.02)):
                row |= {column: str(chance.gauss(value, sd)) for column, value in zip(columns, values)}
            rows.append(row)
    return rows


def suspects(rows):
    return {name: "; ".join(reasons) for name, reasons in plausibility.find_suspects(rows).items() if reasons}


class Plausibility(unittest.TestCase):
    def test_no_good_session_is_suspect(self):
        for seed in range(20):
            self.assertEqual(suspects(fleet(100, seed)), {})

    def test_names_unusual_metrics(self):
        rows = fleet(10)
        rows[3]["mean_mm"], rows[5]["dispersion_mm"], rows[7]["mtf50"] = "300", "50", "0.2"
        found = suspects(rows)
        self.assertEqual(sorted(found), ["c1/2", "c2/2", "c3/2"])
        self.assertRegex(found["c1/2"], "^mean_mm is 300, .* times the median of the archive$")
        self.assertRegex(found["c2/2"], "dispersion_mm is 50")
        self.assertRegex(found["c3/2"], "mtf50 is 0.2, 0.7")
        self.assertEqual(suspects(rows[2:8]), {}, "too few")

    def test_names_camera_of_boards_and_rotation(self):
        rows = fleet(10)
        rows[1] |= {column: rows[4][column] for column in plausibility.IDENTIFYING["boards"]}
        rotation = plausibility.IDENTIFYING["rotation"]
        rows[7] |= {column: rows[12][column] for column in rotation} | {"dispersion_mm": "59"}
        found = suspects(rows)
        self.assertEqual(sorted(found), ["c0/2", "c3/2"])
        self.assertRegex(found["c0/2"], r"^boards: of c2\? .* px from the nearest session of c0, 0 px from c2/1$")
        self.assertRegex(found["c3/2"], r"^rotation: of c6\? .*; dispersion_mm is 59")
        rows[7]["remarks"] = "lens: 1 image skipped; the first, 0.png: is dark; check: lamp 4 hangs 30 mm from its place; check: more"
        self.assertRegex(suspects(rows)["c3/2"], "; check: lamp 4 hangs 30 mm from its place; dispersion_mm")
        rows[7]["remarks"] = "lens: 1 image skipped; the first, 0.png: is dark"
        self.assertRegex(suspects(rows)["c3/2"], "; lens: 1 image skipped; the first, 0.png: is dark; dispersion_mm")

    def test_names_copies_and_lost_inputs(self):
        rows = fleet(3)
        rows[4]["inputs"] = rows[0]["inputs"]
        rows[1] |= {"files": "boards 20, check 6", "expected": "boards 20, check 12, dispersion 8"}
        found = suspects(rows)
        self.assertEqual(found["c2/1"], "is a copy of c0/1")
        self.assertEqual(found["c0/2"], "check has 6 of 12 files; dispersion has 0 of 8 files")
        self.assertEqual(len(found), 2)

    def test_names_copies_of_a_folder_and_exchanged_sessions(self):
        rows = fleet(3)
        rows[1]["copyable"] = '{"boards": "1", "check": "2"}'
        rows[4]["copyable"] = '{"boards": "3", "check": "2"}'
        rows[2]["former_inputs"] = rows[5]["inputs"]
        expected = {"c2/1": "check: the same files as in c0/2", "c2/2": "has the inputs that c1/1 had: renamed or exchanged?"}
        self.assertEqual(suspects(rows), expected)

    def test_names_inputs_and_metrics_that_almost_all_others_have(self):
        rows = fleet(10)
        for row in rows:
            row["files"] = "boards 22, check 15, dispersion 9"
        rows[1]["files"] = "boards 22, check 15"
        rows[2] |= {"files": "boards 20", "verdict": "no result"}
        rows[5]["height_rms_mm"] = ""
        self.assertEqual(suspects(rows), {"c0/2": "dispersion has 0 of 9 files", "c2/2": "height_rms_mm is not known"})
        for row in rows[6:12:2]:  # some have none: it is usual
            row |= {"files": "boards 22, check 15", "height_rms_mm": ""}
        self.assertEqual(suspects(rows), {})
        self.assertEqual(suspects(fleet(3)[:5] + [fleet(3)[5] | {"height_rms_mm": ""}]), {}, "too few")


if __name__ == "__main__":
    unittest.main()
