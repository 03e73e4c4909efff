// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// against_mrcal: solve_intrinsics() and the whole process of mrcal-calibrate-cameras on the same
/// corners, 36 views of a plain board with 0.05 px of noise: processor time of each, and how far
/// the two lenses are apart. Processor time, since it does not depend on what else the machine
/// does. Exit code 1 when the lenses differ, when mrcal-calibrate-cameras fails, or when it is not
/// several times as slow; 77 when it is not installed.
#include <fmt/core.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "calibration/intrinsics/mrcal_files.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

constexpr int kSkipped = 77;  // as CTest is told
constexpr double kApart_px = 0.01;
#ifdef __SANITIZE_ADDRESS__
constexpr double kLeastRatio = 0;  // only the solve here is slowed down
#else
constexpr double kLeastRatio = 5;  // measured: 8.8 to 9.5
#endif

double cpu_of_children_s() {
  constexpr double micro = 1e-6;
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         micro * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

/// Of a .cameramodel.
Lens lens_of(const std::string& model) {
  const std::string key = "'intrinsics': [";
  const char* at = model.c_str() + model.find(key) + key.size();
  std::vector<double> parameters;
  for (std::size_t i = 0; i < parameter_count(LensModel::opencv8); ++i) {
    char* end = nullptr;
    parameters.push_back(std::strtod(at, &end));
    at = end + 1;  // the comma
  }
  return Lens(LensModel::opencv8, parameters);
}

int compare() {
  if (std::system("command -v mrcal-calibrate-cameras >/dev/null") != 0) {
    fmt::print("mrcal-calibrate-cameras is not installed\n");
    return kSkipped;
  }
  constexpr int count = 36, rounds = 10;
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(1);
  IntrinsicsInput input = views.input(count, random, 0.05);
  input.warp = WarpChoice::on;  // as mrcal does
  const std::clock_t from = std::clock();
  IntrinsicsSolution solution = solve_intrinsics(input);
  for (int round = 1; round < rounds; ++round) solution = solve_intrinsics(input);
  const double here_s = static_cast<double>(std::clock() - from) / CLOCKS_PER_SEC / rounds;

  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("against_mrcal." + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  const std::string corners = (folder / "corners.vnl").string();
  std::vector<std::string> names;
  names.reserve(count);
  for (int i = 0; i < count; ++i) names.push_back(fmt::format("{:03}.png", i));
  write_corners(corners, solution, names);
  const std::string command = fmt::format(
      "mrcal-calibrate-cameras --corners-cache {} --lensmodel LENSMODEL_OPENCV8 "
      "--focal 520 --object-spacing {} --object-width-n {} --object-height-n {} "
      "--imagersize 800 600 --outdir {} '*.png' >{}/log 2>&1",
      corners, input.lattice.spacing_m(), input.lattice.cols(), input.lattice.rows(),
      folder.string(), folder.string());
  const int status = std::system(command.c_str());
  const double mrcal_s = cpu_of_children_s();
  std::ostringstream model;
  model << std::ifstream(folder / "camera-0.cameramodel").rdbuf();
  std::ostringstream log;
  log << std::ifstream(folder / "log").rdbuf();
  std::filesystem::remove_all(folder);
  if (status != 0) {
    fmt::print("{}solve {:.3f} s; mrcal-calibrate-cameras failed\n", log.str(), here_s);
    return 1;
  }
  const Lens lens = lens_of(model.str());
  const auto difference =
      projection_difference(lens, solution.lens(), views.imager_px, [](const auto&) { return 1; });
  if (!difference) {
    fmt::print("the lenses share no place\n");
    return 1;
  }
  fmt::print("solve {:.3f} s; mrcal-calibrate-cameras {:.2f} s, {:.1f} times as long\n", here_s,
             mrcal_s, mrcal_s / here_s);
  fmt::print("the lenses are {:.4f} px apart in the mean, {:.4f} px at worst\n",
             difference->mean_px, difference->worst_px);
  const bool good = difference->worst_px <= kApart_px && mrcal_s >= kLeastRatio * here_s;
  if (!good) fmt::print("worse than {} px at worst or {} times\n", kApart_px, kLeastRatio);
  return good ? 0 : 1;
}

}  // namespace
}  // namespace vlp

int main() { return vlp::compare(); }
