// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// against_mrcal: compares solve_intrinsics() with a complete run of mrcal-calibrate-cameras on the
/// same corners.
///
/// The corners are those of a plain board with 0.05 px of noise: 36 views through OPENCV8, and 40
/// views of a 190-degree lens for a splined model. Prints the processor time of both, and the
/// difference of the lenses where the corners determine them, for splined lenses in the same frame.
/// Processor time is independent of other load.
///
/// Exit code 1 if the lenses differ, if mrcal-calibrate-cameras fails, or if for OPENCV8 it is not
/// several times as slow. Exit code 77 if it is not installed.
#include <fmt/core.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "calibration/intrinsics/mrcal_files.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/wide_views.h"
#include "camera/spline_grid.h"

namespace vlp {
namespace {

constexpr int kSkipped = 77;  // SKIP_RETURN_CODE of the test
#ifdef __SANITIZE_ADDRESS__
constexpr double kMinRatio = 0;  // the sanitizer slows down only the solve of this project
#else
constexpr double kMinRatio = 5;  // measured: 8.8 to 9.5
#endif

double cpu_of_children_s() {
  constexpr double micro = 1e-6;
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         micro * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

/// Reads the lens of a .cameramodel.
Lens read_lens(const std::string& text, LensModel model) {
  const std::string key = "'intrinsics': [";
  const char* at = text.c_str() + text.find(key) + key.size();
  std::vector<double> parameters;
  for (std::size_t i = 0; i < num_lens_parameters(model); ++i) {
    char* end = nullptr;
    parameters.push_back(std::strtod(at, &end));
    at = end + 1;  // the comma
  }
  return Lens(model, parameters);
}

/// Writes the corners as write_mrcal_corners() does, with the weights of the solve: relative to the
/// noise for which it is regularized.
void write_weighted(const std::filesystem::path& file, const IntrinsicsSolution& solution,
                    std::span<const std::string> names) {
  write_mrcal_corners(file, solution, names);
  std::ifstream written(file);
  std::string text, line;
  std::getline(written, line);
  for (text = "# filename x y weight\n"; std::getline(written, line); text += "\n") {
    const bool seen = !line.ends_with("-");
    text += seen ? fmt::format("{} {:.17g}", line.substr(0, line.rfind(' ')),
                               1 / solution.problem.noise_px)
                 : line;
  }
  written.close();
  std::ofstream(file) << text;
}

struct Case {
  const char* name;
  IntrinsicsInput input;
  int focal_px;
  /// Arguments of mrcal-calibrate-cameras.
  const char* options;
  /// Limit of the uncertainty of projections below which the lenses are compared.
  double known_px;
  double max_apart_px, min_ratio;
};

/// Repeats mrcal's solve from the result of mrcal-calibrate-cameras, with the core of the solution.
/// The rays that fix its frame are included, because a splined lens can rotate freely.
constexpr const char* kInTheFrame = R"(
import sys, mrcal, numpy as np
file, core, held = sys.argv[1], np.array(eval(sys.argv[2])), np.array(eval(sys.argv[3]))
inputs = mrcal.cameramodel(file).optimization_inputs()
inputs['intrinsics'][0, :4] = core
indices = np.zeros((len(held), 3), np.int32)
indices[:, 0], indices[:, 2] = range(len(held)), -1
inputs |= dict(points=held[:, 3:].copy(), observations_point=held[:, :3].copy(),
               indices_point_camintrinsics_camextrinsics=indices,
               Npoints_fixed=len(held), point_min_range=0.1, point_max_range=10.)
mrcal.optimize(**inputs)
print("'intrinsics': [" + ','.join('%.17g' % x for x in inputs['intrinsics'][0]) + ']')
)";

int run_in_the_frame(const std::filesystem::path& folder, const BoardProblem& problem) {
  std::string core, fixed_rays;
  for (std::size_t i = 0; i < 4; ++i) core += fmt::format("{:.17g},", problem.intrinsics[i]);
  for (const auto& [pixel, ray] : problem.fixed_rays) {
    const Eigen::Vector3d unit = ray.normalized();
    fixed_rays += fmt::format("[{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}],", pixel.x(),
                              pixel.y(), 1 / problem.noise_px, unit.x(), unit.y(), unit.z());
  }
  const std::string script = (folder / "in_the_frame.py").string(),
                    model = (folder / "camera-0.cameramodel").string();
  std::ofstream(script) << kInTheFrame;
  return std::system(
      fmt::format("/usr/bin/python3 {0} {1} '[{2}]' '[{3}]' >{1}.held && mv {1}.held {1}", script,
                  model, core, fixed_rays)
          .c_str());
}

bool compare(const Case& test_case, int num_repetitions) {
  const double children_s = cpu_of_children_s();
  const std::clock_t from = std::clock();
  IntrinsicsSolution solution = solve_intrinsics(test_case.input);
  for (int round = 1; round < num_repetitions; ++round)
    solution = solve_intrinsics(test_case.input);
  const double here_s = static_cast<double>(std::clock() - from) / CLOCKS_PER_SEC / num_repetitions;

  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("against_mrcal." + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  const std::string corners = (folder / "corners.vnl").string();
  std::vector<std::string> names;
  for (std::size_t i = 0; i < test_case.input.views.size(); ++i)
    names.push_back(fmt::format("{:03}.png", i));
  write_weighted(corners, solution, names);
  const auto [width, height] = test_case.input.imager_px;
  const std::string command = fmt::format(
      "mrcal-calibrate-cameras --corners-cache {} --corners-cache-has-weights --lensmodel {} "
      "--focal {} --object-spacing {} --object-width-n {} --object-height-n {} "
      "--imagersize {} {} --outdir {} {} '*.png*' >{}/log 2>&1",
      corners, lens_model_name(test_case.input.lens_model), test_case.focal_px,
      test_case.input.lattice.point_spacing_m(), test_case.input.lattice.lattice_cols(),
      test_case.input.lattice.lattice_rows(), width, height, folder.string(), test_case.options,
      folder.string());
  int status = std::system(command.c_str());
  const double mrcal_s = cpu_of_children_s() - children_s;
  if (status == 0 && !solution.problem.fixed_rays.empty()) {
    status = run_in_the_frame(folder, solution.problem);
  }
  std::ostringstream model;
  model << std::ifstream(folder / "camera-0.cameramodel").rdbuf();
  std::ostringstream log;
  log << std::ifstream(folder / "log").rdbuf();
  std::filesystem::remove_all(folder);
  if (status != 0) {
    fmt::print("{}{}: solve {:.3f} s; mrcal-calibrate-cameras failed\n", log.str(), test_case.name,
               here_s);
    return false;
  }
  const ProjectionUncertainty uncertainty(solution);
  const auto known = [&](const Eigen::Vector2d& pixel) {
    return uncertainty.worst_direction_sd_px(pixel) <= test_case.known_px ? 1.0 : INFINITY;
  };
  const auto difference =
      compare_projections(read_lens(model.str(), test_case.input.lens_model),
                          solution.fitted_lens(), test_case.input.imager_px, known);
  if (!difference) {
    fmt::print("{}: the lenses share no place\n", test_case.name);
    return false;
  }
  fmt::print("{}: solve {:.3f} s; mrcal-calibrate-cameras {:.2f} s, {:.1f} times as long\n",
             test_case.name, here_s, mrcal_s, mrcal_s / here_s);
  fmt::print("the lenses are {:.6f} px apart in the mean, {:.6f} px at worst\n",
             difference->mean_px, difference->worst_px);
  const bool is_good =
      difference->worst_px <= test_case.max_apart_px && mrcal_s >= test_case.min_ratio * here_s;
  if (!is_good)
    fmt::print("worse than {} px at worst or {} times\n", test_case.max_apart_px,
               test_case.min_ratio);
  return is_good;
}

int compare() {
  if (std::system("command -v mrcal-calibrate-cameras >/dev/null") != 0) {
    fmt::print("mrcal-calibrate-cameras is not installed\n");
    return kSkipped;
  }
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(1);
  Case plain{"OPENCV8", views.input(36, random, 0.05), 520, "", 1, 0.01, kMinRatio};
  plain.input.warp = WarpChoice::on;  // as mrcal does
  const WideBoards boards{0.1, 0.2, 100 * std::numbers::pi / 180, true};
  Case splined{"splined",
               wide_input(false, 40, random, 0.05, {0, 0}, boards),
               270,
               "--skip-outlier-rejection",  // outliers are already rejected
               0.05,
               0.001,
               0};
  splined.input.lens_model = splined_lens_model({3, 14, 14, 205});
  splined.input.warp = WarpChoice::on;
  const bool plain_good = compare(plain, 10), splined_good = compare(splined, 1);
  return plain_good && splined_good ? 0 : 1;
}

}  // namespace
}  // namespace vlp

int main() { return vlp::compare(); }
