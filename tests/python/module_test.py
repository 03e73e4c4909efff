#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""The Python module: reads files, computes the fixes of the library, rejects invalid input."""

import ast
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np
import PIL.Image
import vlp

SOURCE = pathlib.Path(__file__).resolve().parents[2]
EXAMPLE = SOURCE / "datasets/example"
RENDERED = SOURCE / "datasets/paper-rig/rendered"


class Module(unittest.TestCase):
    def setUp(self):
        self.lamps = vlp.LampMap(EXAMPLE / "lamps.yaml")
        self.calibration = vlp.Calibration(EXAMPLE / "calibration.yaml")
        self.positioner = vlp.Positioner(self.lamps, self.calibration)
        self.seen = vlp.read_detections(EXAMPLE / "detections.csv")
        self.truth = vlp.read_truth(EXAMPLE / "truth.csv")

    def located(self, **options):
        seen = self.seen
        return self.positioner.locate_frames(
            seen["frames"], seen["lamps"], seen["pixels"], seen["sigma_px"], **options
        )

    def test_readers_match_files(self):
        self.assertEqual(list(self.lamps.ids), [1, 2, 3, 4, 5])
        self.assertEqual(list(self.lamps.positions_m[4]), [0.05, 0, 1.5])
        self.assertEqual(self.calibration.imager_px, [800, 600])
        self.assertEqual(self.calibration.lens_model, "LENSMODEL_OPENCV8")
        self.assertEqual(self.calibration.row_time_s, 3e-5)
        self.assertEqual(len(self.seen["images"]), 36)
        self.assertGreater(len(self.seen["lamps"]), 0)
        self.assertEqual(self.seen["pixels"].shape, (len(self.seen["lamps"]), 2))

    def test_unproject_inverts_project(self):
        pixels = np.array([[10.0, 20], [400, 300], [790, 590]])
        lens = self.calibration.lens
        np.testing.assert_allclose(lens.project(5 * lens.unproject(pixels)), pixels, atol=1e-8)
        self.assertTrue(np.isnan(lens.project([[0.0, 0, -1]])).all())
        same = vlp.Lens(self.calibration.lens_model, self.calibration.intrinsics)
        np.testing.assert_array_equal(same.unproject(pixels), lens.unproject(pixels))

    def test_locate_frames_matches_ground_truth(self):
        fixes = self.located()
        self.assertEqual(len(fixes["status"]), 36)
        self.assertTrue((fixes["status"] == 0).all())
        error = fixes["position_m"] - self.truth["position_m"]
        self.assertLess(np.abs(error).max(), 1e-3)
        turn = fixes["yaw_rad"] - self.truth["yaw_rad"]
        self.assertLess(np.abs(np.sin(turn)).max(), 1e-3)
        sd = np.sqrt(np.diagonal(fixes["covariance"], axis1=1, axis2=2))
        self.assertLess(np.abs(error / sd[:, :3]).max(), 5)

    def test_locate_matches_locate_frames(self):
        fixes = self.located()
        of_3 = self.seen["frames"] == 3
        seen = [self.seen[name][of_3] for name in ("lamps", "pixels", "sigma_px")]
        fix = self.positioner.locate(*seen)
        self.assertTrue(fix.ok)
        np.testing.assert_array_equal(fix.position_m, fixes["position_m"][3])
        np.testing.assert_allclose(fix.covariance, fixes["covariance"][3], rtol=1e-12, atol=1e-30)
        self.assertEqual(fix.lamps, fixes["lamps"][3])
        leaning = self.positioner.locate(*seen, vlp.Sensors(inclination_sigma_rad=0.1, time_s=7))
        self.assertEqual(leaning.time_s, 7)
        self.assertLess(abs(leaning.state[7]), 0.01)
        self.assertGreater(leaning.covariance[7, 7], 0)
        mounted = vlp.Positioner(self.lamps, self.calibration, mount=(0, 0, 0.5, 0)).locate(*seen)
        self.assertAlmostEqual(mounted.position_m[2], fix.position_m[2] - 0.5)

    def test_residuals_and_project_agree_with_fix(self):
        of_3 = self.seen["frames"] == 3
        lamps, pixels = self.seen["lamps"][of_3], self.seen["pixels"][of_3]
        fix = self.positioner.locate(lamps, pixels, self.seen["sigma_px"][of_3])
        of_each = self.positioner.residuals(lamps, pixels, fix)
        self.assertEqual(of_each["use"], ["used"] * len(lamps))
        rms_px = np.sqrt((of_each["residual_px"] ** 2).sum(axis=1).mean())
        self.assertAlmostEqual(rms_px, fix.residual_px, 3)
        pixel, jacobian = self.positioner.project(lamps[0], fix.state)
        np.testing.assert_array_equal(pixel, of_each["predicted_px"][0])
        np.testing.assert_array_equal(jacobian, of_each["jacobian"][0])
        moved = fix.state + 1e-6 * np.eye(9)[0]
        change = (self.positioner.project(lamps[0], moved)[0] - pixel) / 1e-6
        np.testing.assert_allclose(change, jacobian[:, 0], rtol=1e-3, atol=1e-3)
        unknown = self.positioner.residuals([1000], [[400.0, 300]], fix)
        self.assertEqual(unknown["use"], ["not_in_map"])

    def test_ambiguous_fix_lists_candidates(self):
        of_3 = self.seen["frames"] == 3
        seen = [self.seen[name][of_3][:3] for name in ("lamps", "pixels", "sigma_px")]
        fix = self.positioner.locate(*seen, vlp.Sensors(inclination_sigma_rad=1.6))
        self.assertEqual(fix.status, "ambiguous")
        self.assertGreaterEqual(len(fix.candidates), 2)
        self.assertAlmostEqual(sum(likelihood for _, likelihood in fix.candidates), 1)
        nearest = min(np.abs(s[:3] - self.truth["position_m"][3]).max() for s, _ in fix.candidates)
        self.assertLess(nearest, 0.1)

    def test_prior_replaces_readings(self):
        of_3 = self.seen["frames"] == 3
        seen = [self.seen[name][of_3] for name in ("lamps", "pixels", "sigma_px")]
        known = self.positioner.locate(*seen, vlp.Sensors(inclination_sigma_rad=0.1))
        variances = np.r_[4 * [np.inf], 3 * [0.0], 2 * [0.01]]
        prior = vlp.Sensors(prior=(np.zeros(9), np.diag(variances)))
        fix = self.positioner.locate(*seen, prior)
        np.testing.assert_allclose(fix.state, known.state, atol=1e-12)
        np.testing.assert_allclose(fix.covariance, known.covariance, atol=1e-12)

    def test_locate_one_lamp_returns_regular_covariance(self):
        seen = [self.seen[name][:1] for name in ("lamps", "pixels", "sigma_px")]
        exact = self.positioner.locate(*seen, vlp.Sensors(height_and_yaw=(0, 0)))
        stated = self.positioner.locate(
            *seen, vlp.Sensors(height_and_yaw=(0, 0), height_and_yaw_sd=(0.005, 0.02))
        )
        self.assertTrue(exact.ok and stated.ok)
        self.assertLess(exact.covariance[2, 2], 1e-17)
        self.assertAlmostEqual(stated.covariance[2, 2], 0.005**2)
        self.assertGreater(np.linalg.eigvalsh(stated.covariance[:4, :4]).min(), 0)
        self.assertEqual(stated.rejected_ids, [])
        self.assertEqual(np.abs(stated.covariance[4:]).max(), 0)

    def test_locate_reports_rejected_lamps(self):
        of_3 = self.seen["frames"] == 3
        lamps, pixels, sigma_px = (
            self.seen[name][of_3].copy() for name in ("lamps", "pixels", "sigma_px")
        )
        self.assertEqual(len(lamps), 5)
        pixels[0, 0] += 60
        fix = self.positioner.locate(lamps, pixels, sigma_px)
        self.assertEqual(fix.rejected_ids, [lamps[0]])

    def test_locate_estimates_velocity_from_earlier_frames(self):
        of_3 = self.seen["frames"] == 3
        seen = [self.seen[name][of_3] for name in ("lamps", "pixels", "sigma_px")]
        sensors = vlp.Sensors(velocity_sd_m_per_s=1)
        alone = self.positioner.locate(*seen, sensors)
        together = self.positioner.locate(*seen, sensors, earlier=[(*seen, 0.05)])
        self.assertTrue(alone.ok and together.ok)
        self.assertEqual(together.covariance.shape, (9, 9))
        self.assertLess(together.covariance[4, 4], 0.01 * alone.covariance[4, 4])
        self.assertLess(np.abs(together.state[4:6]).max(), 0.01)

    def test_locate_reports_status_without_fix(self):
        fix = self.positioner.locate([1], [[400.0, 300]])
        self.assertFalse(fix.ok)
        self.assertEqual(fix.status, "too_few_lamps")
        for figure in ("position_m", "yaw_rad", "covariance", "noise_covariance", "residual_px"):
            self.assertTrue(np.isnan(getattr(fix, figure)).all(), figure)
        self.assertTrue(np.isnan(fix.state).all())
        no_sd = vlp.Sensors(height_m=(0, 0))
        fix = self.positioner.locate([1, 2], [[400.0, 300], [500, 300]], sensors=no_sd)
        self.assertEqual(fix.status, "not_finite")
        self.assertIn("that of a known height is not positive", fix.explanation)
        fixes = self.positioner.locate_frames([0, 1, 1], [1, 1, 2], [[400.0, 300]] * 3)
        self.assertEqual(vlp.STATUSES[fixes["status"][0]], "too_few_lamps")
        self.assertTrue(np.isnan(fixes["position_m"]).all())
        self.assertIn("fewer than two", vlp.explanation(fixes["status"][0]))

    def test_rejects_invalid_arguments(self):
        with self.assertRaisesRegex(vlp.InputError, "none.yaml"):
            vlp.LampMap("none.yaml")
        with self.assertRaisesRegex(ValueError, "shape"):
            self.positioner.locate([1, 2], [1.0, 2])
        with self.assertRaisesRegex(ValueError, "one for each"):
            self.positioner.locate([1, 2, 3], [[1.0, 2], [3, 4]])
        wraps_to_minus_1 = np.array([1, 2**64 - 1], np.uint64)
        of_no_numbers = np.zeros(0, [("id", int), ("name", "U3")])
        for lamps in ([1.7, 2], ["1", "2"], [True, False], [1, 1 + 2**32], [[1], [2, 3]], None,
                      wraps_to_minus_1, of_no_numbers):
            with self.assertRaisesRegex(ValueError, "lamps should be integers"):
                self.positioner.locate(lamps, [[1.0, 2], [3, 4]])
        with self.assertRaisesRegex(ValueError, "frames should be integers"):
            self.positioner.locate_frames([0.5, 1], [1, 2], [[1.0, 2], [3, 4]])
        self.assertEqual(self.positioner.locate([], np.zeros((0, 2))).status, "too_few_lamps")
        with self.assertRaisesRegex(ValueError, "correction"):
            vlp.Positioner(self.lamps, self.calibration, correction="some")
        with self.assertRaisesRegex(ValueError, "uint8"):
            vlp.LampDetector(self.lamps, self.calibration).detect(np.zeros((5, 5)))
        with self.assertRaisesRegex(ValueError, "is 800 x 599, .* has 800 x 600 px"):
            vlp.LampDetector(self.lamps, self.calibration).detect(np.zeros((599, 800), np.uint8))
        with self.assertRaises(ValueError):
            vlp.Lens("LENSMODEL_NONE", [1, 1, 0, 0])

    def detector(self):
        return vlp.LampDetector(
            vlp.LampMap(RENDERED / "lamps.yaml"),
            vlp.Calibration(RENDERED / "true_calibration.yaml"),
        )

    def test_detect_matches_detections_table(self):
        detector = self.detector()
        true = vlp.read_detections(RENDERED / "sample/true_detections.csv")
        image = true["images"][0]
        lamps, pixels, sigma_px = detector.detect(np.array(PIL.Image.open(RENDERED / "sample" / image)))
        self.assertGreaterEqual(len(lamps), 2)
        for lamp, pixel, sigma in zip(lamps, pixels, sigma_px):
            row = (true["frames"] == 0) & (true["lamps"] == lamp)
            self.assertLess(np.linalg.norm(true["pixels"][row][0] - pixel), 6 * sigma + 0.05)

    def test_locate_image_returns_fix_of_its_detections(self):
        image = np.array(PIL.Image.open(RENDERED / "sample/0000.png"))
        calibration = vlp.Calibration(RENDERED / "true_calibration.yaml")
        positioner = vlp.Positioner(vlp.LampMap(RENDERED / "lamps.yaml"), calibration)
        level, seen = positioner.locate_image(self.detector(), image)
        for one, other in zip(seen, self.detector().detect(image)):
            np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(level.state, positioner.locate(*seen).state)
        sensors = vlp.Sensors(inclination_sigma_rad=0.2)
        fix, seen = positioner.locate_image(self.detector(), image, sensors)
        self.assertTrue(fix.ok)
        np.testing.assert_array_equal(fix.state, positioner.locate(*seen, sensors).state)

    def test_detect_identifies_lamps_of_one_room(self):
        text = (RENDERED / "lamps.yaml").read_text()
        hall = text.replace("{id: ", "{room: hall, id: ")
        office = re.sub(r"id: (\d)", r"room: office, id: 1\1", text).replace(", 1.6]", ", 1.7]")
        calibration = vlp.Calibration(RENDERED / "true_calibration.yaml")
        image = np.array(PIL.Image.open(RENDERED / "sample/0000.png"))
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "lamps.yaml"
            file.write_text(hall + office[office.index("  - ") :])
            whole = vlp.LampMap(file)
            self.assertEqual(len(whole), 12)
            with self.assertRaisesRegex(
                vlp.InputError, "lamps.yaml: .* with the argument room of LampMap; the map has: hall, office"
            ):
                vlp.LampDetector(whole, calibration)
            vlp.Positioner(whole, calibration)  # whose lamps are identified elsewhere
            lamps, _, _ = vlp.LampDetector(vlp.LampMap(file, room="office"), calibration).detect(image)
            self.assertEqual(sorted(lamps), [11, 12, 13, 14, 15, 16])
            with self.assertRaisesRegex(vlp.InputError, "has no lamp with 'room: attic'"):
                vlp.LampMap(file, "attic")

    def test_lamps_below_camera_turn_fixes_over(self):
        turned = re.sub(
            r"position_m: \[(.*?), (.*?), (.*?)\]",
            lambda m: f"position_m: [{m[1]}, {-float(m[2])}, {-float(m[3])}]",
            (EXAMPLE / "lamps.yaml").read_text(),
        )
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "lamps.yaml"
            file.write_text(turned.replace("lamps:", "lamps_below_camera: true\nlamps:"))
            self.positioner = vlp.Positioner(vlp.LampMap(file), self.calibration)
        fixes = self.located()
        self.assertTrue((fixes["status"] == 0).all())
        signs = np.array([1, -1, -1])
        np.testing.assert_allclose(fixes["position_m"] * signs, self.truth["position_m"], atol=1e-3)
        np.testing.assert_allclose(
            np.cos(fixes["yaw_rad"] + self.truth["yaw_rad"]), 1, atol=1e-6
        )

    def test_detect_accepts_any_memory_layout(self):
        detector = self.detector()
        image = np.array(PIL.Image.open(RENDERED / "sample/0000.png"))
        found = detector.detect(image)
        self.assertEqual(len(found[0]), 6)
        wide = np.zeros((image.shape[0], 2 * image.shape[1]), image.dtype)
        wide[:, ::2] = image  # whose rows do not follow each other
        for given in (np.asfortranarray(image), wide[:, ::2]):
            for one, other in zip(found, detector.detect(given)):
                np.testing.assert_array_equal(one, other)
        begin = time.process_time()
        for _ in range(100):
            detector.detect(image)
        print(f"{10 * (time.process_time() - begin):.3f} ms of processor time a frame")

    def test_locate_frames_is_fast(self):
        copies = 100000 // len(self.seen["images"]) + 1
        count = len(self.seen["images"])
        frames = np.concatenate([self.seen["frames"] + count * i for i in range(copies)])
        lamps = np.tile(self.seen["lamps"], copies)
        pixels = np.tile(self.seen["pixels"], (copies, 1))
        begin = time.process_time()
        fixes = self.positioner.locate_frames(frames, lamps, pixels)
        took = time.process_time() - begin
        print(f"{len(fixes['status'])} fixes in {took:.2f} s of processor time")
        self.assertEqual(len(fixes["status"]), count * copies)
        self.assertTrue((fixes["status"] == 0).all())
        self.assertLess(took, 5)  # 1 s on a machine of its own

    def test_stubs_match_module(self):
        stubs = ast.parse((SOURCE / "lib/python/vlp-stubs/__init__.pyi").read_text()).body
        functions = [node for node in stubs if isinstance(node, ast.FunctionDef)]
        classes = [node for node in stubs if isinstance(node, ast.ClassDef)]
        tables = {
            node.name: [field.target.id for field in node.body if isinstance(field, ast.AnnAssign)]
            for node in classes
            if [base.id for base in node.bases] == ["TypedDict"]
        }
        classes = [node for node in classes if node.name not in tables]

        def parameters(function):
            arguments = function.args.args + function.args.kwonlyargs
            return [argument.arg for argument in arguments if argument.arg != "self"]

        def documented(function):  # pybind11's "locate(self: vlp.Positioner, lamps: object) -> ..."
            names = re.findall(r"(?:\(|, )(\w+): ", function.__doc__.split("\n")[0])
            return [name for name in names if name != "self"]

        variables = {node.target.id for node in stubs if isinstance(node, ast.AnnAssign)}
        self.assertEqual(
            {node.name for node in functions + classes} | variables,
            {name for name in dir(vlp) if not name.startswith("_")} | {"__version__"},
        )
        for function in functions:
            self.assertEqual(parameters(function), documented(getattr(vlp, function.name)))
        for node in classes:
            of_module = getattr(vlp, node.name)
            methods = [method for method in node.body if isinstance(method, ast.FunctionDef)]
            self.assertEqual(
                {method.name for method in methods if not method.name.startswith("_")},
                {name for name in vars(of_module) if not name.startswith("_")},
            )
            for method in methods:
                called = not method.decorator_list and method.name != "__len__"
                if called:
                    names = documented(getattr(of_module, method.name))
                    self.assertEqual(parameters(method), names, (node.name, method.name))
        self.assertEqual(tables["Fixes"], list(self.located()))
        self.assertEqual(tables["DetectionsTable"], list(self.seen))
        self.assertEqual(tables["TruthTable"], list(self.truth))

    @unittest.skipUnless("VLP_PYBIND11_VERSION" in os.environ, "run by ctest -R Python.Module")
    def test_import_rejects_numpy_2_without_pybind11_support(self):
        imports = "import sys, numpy; numpy.__version__ = '2.0.0'; import vlp"
        told = subprocess.run([sys.executable, "-c", imports], capture_output=True, text=True)
        version = [int(number) for number in os.environ["VLP_PYBIND11_VERSION"].split(".")[:2]]
        if version >= [2, 12]:
            self.assertEqual((told.returncode, told.stderr), (0, ""))
            return
        last = told.stderr.splitlines()[-1]
        self.assertRegex(last, r"^ImportError: vlp was built with pybind11 2\.\d+, which does not")
        self.assertRegex(last, r'NumPy 2\.0\.0: install "numpy<2", or build vlp with pybind11 2\.12')

    def test_example_runs(self):
        example = [sys.executable, SOURCE / "lib/python/example.py", EXAMPLE]
        told = subprocess.run(example, capture_output=True, text=True, check=True).stdout
        self.assertRegex(told, "5 lamps")
        self.assertRegex(told, r"\d+ fixes, mean error 0\.\d+ mm")


if __name__ == "__main__":
    unittest.main()
