// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/mrcal_files.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

/// Returns a solution of 3 x 2 points on two boards.
IntrinsicsSolution make_small_solution(LensModel model, std::vector<double> intrinsics) {
  IntrinsicsSolution solution{};
  BoardProblem& problem = solution.problem;
  problem.lens_model = model;
  problem.intrinsics = std::move(intrinsics);
  problem.imager_px = {800, 600};
  problem.cols = 3;
  problem.rows = 2;
  problem.spacing_m = 0.025;
  problem.warp_m = {0.001, -0.002};
  problem.noise_px = 0.5;
  problem.poses = {{{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}}, {{-0.1, -0.2, -0.3}, {-0.4, -0.5, 0.7}}};
  for (int i = 0; i < 12; ++i)
    problem.points.emplace_back(100 + 10 * i, 120 - i, i == 4 ? -1 : 0.25);
  return solution;
}

/// Returns the entries of the inputs of the solve as Python reads them: name, type, value.
std::string read_optimization_inputs(const IntrinsicsSolution& solution) {
  const TemporaryFolder folder;
  write_cameramodel(folder / "a.cameramodel", solution, {});
  const auto script =
      folder.file("read.py",
                  "import ast, base64, io, sys, numpy\n"
                  "model = ast.literal_eval(open(sys.argv[1]).read())\n"
                  "data = io.BytesIO(base64.b85decode(model['optimization_inputs']))\n"
                  "for name, value in sorted(numpy.load(data, allow_pickle=False).items()):\n"
                  "    print(name, value.dtype.str, value.shape, *value.flatten(), sep=' ')\n");
  const auto [code, text, errors] = run_program("/usr/bin/python3 " + script.string() + " " +
                                                (folder / "a.cameramodel").string());
  EXPECT_EQ(code, 0) << errors;
  return text;
}

TEST(WriteCameramodel, WritesLensWith17DigitsAndImageSize) {
  const TemporaryFolder folder;
  write_cameramodel(folder / "a.cameramodel",
                    make_small_solution(LensModel::pinhole, {500.1, 501, 400, 300}), {});
  const std::string text = TemporaryFolder::read_content(folder / "a.cameramodel");
  EXPECT_TRUE(
      text.starts_with("{\n"
                       "    'lensmodel':  'LENSMODEL_PINHOLE',\n"
                       "    'intrinsics': [ 500.10000000000002, 501, 400, 300,],\n"
                       "    'extrinsics': [ 0, 0, 0, 0, 0, 0 ],\n"
                       "    'imagersize': [ 800, 600 ],\n"
                       "    'icam_intrinsics': 0,\n"))
      << text;
  EXPECT_TRUE(text.ends_with("',\n}\n"));
}

/// Weights are divided by the noise.
TEST(WriteCameramodel, WritesOptimizationInputsForMrcal) {
  if (run_program("/usr/bin/python3 -c 'import numpy'").exit_code != 0) GTEST_SKIP() << "no numpy";
  std::string points;
  for (int i = 0; i < 12; ++i) {
    points += " " + std::to_string(100 + 10 * i) + ".0 " + std::to_string(120 - i) + ".0 " +
              (i == 4 ? "-2.0" : "0.5");
  }
  EXPECT_EQ(read_optimization_inputs(make_small_solution(
                LensModel::opencv4, {500, 501, 400, 300, 0.1, 0.2, 0.003, 0.004})),
            "calibration_object_spacing <f8 () 0.025\n"
            "calobject_warp <f8 (2,) 0.001 -0.002\n"
            "do_apply_outlier_rejection |b1 () True\n"
            "do_apply_regularization |b1 () True\n"
            "do_optimize_calobject_warp |b1 () True\n"
            "do_optimize_extrinsics |b1 () True\n"
            "do_optimize_frames |b1 () True\n"
            "do_optimize_intrinsics_core |b1 () True\n"
            "do_optimize_intrinsics_distortions |b1 () True\n"
            "extrinsics_rt_fromref <f8 (0, 6)\n"
            "frames_rt_toref <f8 (2, 6) 0.1 0.2 0.3 0.4 0.5 0.6 -0.1 -0.2 -0.3 -0.4 -0.5 0.7\n"
            "imagersizes <i4 (1, 2) 800 600\n"
            "indices_frame_camintrinsics_camextrinsics <i4 (2, 3) 0 0 -1 1 0 -1\n"
            "indices_point_camintrinsics_camextrinsics <U1 () \n"
            "intrinsics <f8 (1, 8) 500.0 501.0 400.0 300.0 0.1 0.2 0.003 0.004\n"
            "lensmodel <U17 () LENSMODEL_OPENCV4\n"
            "observations_board <f8 (2, 2, 3, 3)" +
                points +
                "\nobservations_point <U1 () \n"
                "points <U1 () \n"
                "verbose |b1 () False\n");
  IntrinsicsSolution fixed = make_small_solution(LensModel::pinhole, {500, 501, 400, 300});
  fixed.solved_parameters.core = fixed.solved_parameters.warp = false;
  const std::string text = read_optimization_inputs(fixed);
  for (const char* const name :
       {"do_optimize_intrinsics_core", "do_optimize_intrinsics_distortions",
        "do_optimize_calobject_warp", "do_apply_regularization"}) {
    EXPECT_NE(text.find(std::string(name) + " |b1 () False\n"), text.npos) << name;
  }
}

}  // namespace
}  // namespace vlp
