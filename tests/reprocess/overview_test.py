#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Verdict, actions and metrics before and now in the overview; layouts of archives."""
import os
import re
import tempfile
import unittest
from pathlib import Path

import parts  # noqa: F401
import changes
import layout
import overview


def row(session, verdict, mean="", rms="", inputs="same", reason=""):
    return {
        "camera": "c",
        "session": session,
        "verdict": verdict,
        "mean_mm": mean,
        "rms_px": rms,
        "inputs": inputs,
        "reason": reason,
    }


def document_of(rows, items, limits):
    counts = changes.count_verdicts(rows)
    gates = changes.check_gates(limits, counts, None, items)
    return {"counts": counts, "gates": gates, "passed": all(gate["passed"] for gate in gates)}


def items_of(**items):
    return {"vanished": [], "suspect": [], "lost_results": [], "cameras_changed": [], "lamps_moved": []} | items


class Overview(unittest.TestCase):
    def test_begins_with_verdict_and_most_urgent_action(self):
        rows = [row("1", "review", "1"), row("2", "no result", reason="rotation: is missing"), row("3", "gate", "9")]
        items = items_of(vanished=["c/9"], lost_results=["c/2"], cameras_changed=["c: focal"], lamps_moved=["lamp 2"])
        document = document_of(rows, items, {"vanished": 0, "mean_mm": 1})
        self.assertEqual(
            [section for _, section in overview.list_actions(document, items, rows)],
            ["vanished", "failed", "cameras", "lamps", "gates", "session-gates", "review"],
        )
        html = overview.render_verdict(document, items, rows)
        self.assertTrue(html.startswith('<p class="verdict">FAIL</p>'))
        self.assertLess(html.index("c/9"), html.index("c: focal"))
        document = document_of(rows, items, {"no_result_fraction": 0.1})
        self.assertEqual(overview.list_actions(document, items, rows)[0][1], "failed")
        self.assertIn("INCOMPLETE", overview.render_verdict(document, items, rows))
        good = [row("1", "pass", "1")]
        document = document_of(good, items_of(), changes.DEFAULT_GATES)
        self.assertIn("PASS</p>\n<p>Nothing to do", overview.render_verdict(document, items_of(), good))

    def test_names_five_items_and_counts_others(self):
        self.assertEqual(overview.join_items(list("abcdefg"), 5), "a; b; c; d; e; and 2 more in changes.json")

    def test_each_action_links_to_a_section(self):
        rows = [row("1", "review", "1"), row("2", "no result"), row("3", "gate", "9")]
        rows = [one | {"images_skipped": "", "rejected_lamps": "", "remarks": ""} for one in rows]
        items = items_of(vanished=["c/9"], lost_results=["c/2"])
        document = document_of(rows, items, {"vanished": 0, "mean_mm": 1})
        html = overview.render_page({"version": "1", "toolbox": "t"}, rows, document, items, "", "")
        sections = re.findall(r'href="#([^"]*)"', html)
        self.assertGreater(len(sections), 0)
        for section in sections:
            self.assertIn(f'id="{section}"', html)

    def test_shows_metrics_before_and_now_for_changed_inputs(self):
        with tempfile.TemporaryDirectory() as folder:
            self.addCleanup(os.chdir, os.getcwd())
            os.chdir(folder)
            before, rows = [row("1", "pass", "0.25", "0.01", "old")], [row("1", "gate", "2.5", "0.02", "new")]
            found, _ = changes.compare_results(rows, before)
            html = overview.changed_inputs(Path("previous"), rows, before, found)
            cells = "".join(f"<td>{cell}</td>" for cell in ("pass", "gate", "0.25", "2.5", "0.01", "0.02"))
            self.assertIn(cells, html)
            self.assertIn("mean mm before", html)


class Layout(unittest.TestCase):
    def test_describes_wrong_level(self):
        with tempfile.TemporaryDirectory() as folder:
            archive = Path(folder).resolve() / "archive"
            session = archive / "camera/session"
            for name in ("boards", "rotation", "check"):
                (session / name).mkdir(parents=True)
            for name in ("lamps.yaml", "board.yaml"):
                (session / name).write_text("")

            def problem(place):
                return layout.check_layout(place, layout.list_sessions_in(place, []))

            self.assertEqual(problem(archive), "")
            self.assertIn(f"one level too deep: give {archive}", problem(archive / "camera"))
            self.assertIn(f"two levels too deep: give {archive}", problem(session))
            self.assertIn(f"one level too high: give {archive}", problem(archive.parent))
            (session / "rotation").rmdir()
            self.assertEqual(problem(archive), "")  # it is for the session to fail
            self.assertEqual(layout.find_missing_inputs(session), ["rotation"])
            words = layout.describe_missing_inputs(archive, ["camera/session"])
            self.assertTrue(words.startswith("rotation is missing in 1 session; the layout is"), words)


if __name__ == "__main__":
    unittest.main()
