// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/mrcal_files.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "calibration/intrinsics/camera_exports.h"
#include "calibration/intrinsics/numpy_archive.h"
#include "captures/number_text.h"
#include "rig/file.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

constexpr int kDigits = 17;

/// Formats all arguments of mrcal.optimize(), at the solution.
std::string format_optimization(const IntrinsicsSolution& solution) {
  const BoardProblem& problem = solution.problem;
  const std::size_t boards = problem.poses.size();
  const auto rows = static_cast<std::size_t>(problem.rows);
  const auto cols = static_cast<std::size_t>(problem.cols);
  std::vector<double> poses, points;
  std::vector<std::int32_t> indices;
  for (std::size_t i = 0; i < boards; ++i) {
    const auto& [rotation, translation_m] = problem.poses[i];
    poses.insert(poses.end(), rotation.begin(), rotation.end());
    poses.insert(poses.end(), translation_m.begin(), translation_m.end());
    indices.insert(indices.end(), {static_cast<std::int32_t>(i), 0, -1});
  }
  points.reserve(3 * problem.points.size());
  for (const auto& point : problem.points) {
    const double weight = point.z() * (1 / problem.noise_px);
    points.insert(points.end(), {point.x(), point.y(), weight});
  }
  const std::array<std::int32_t, 2> imager{problem.imager_px[0], problem.imager_px[1]};

  NumpyArchive archive;
  archive.add_npz_array("lensmodel", lens_model_name(problem.lens_model));
  archive.add_npz_array("intrinsics", {1, problem.intrinsics.size()}, problem.intrinsics);
  archive.add_npz_array("extrinsics_rt_fromref", {0, 6}, std::span<const double>{});
  archive.add_npz_array("frames_rt_toref", {boards, 6}, poses);
  archive.add_npz_array("observations_board", {boards, rows, cols, 3}, points);
  archive.add_npz_array("indices_frame_camintrinsics_camextrinsics", {boards, 3}, indices);
  archive.add_npz_array("calobject_warp", {2}, std::span(problem.warp_m.data(), 2));
  archive.add_npz_array("imagersizes", {1, 2}, imager);
  archive.add_npz_array("calibration_object_spacing", problem.spacing_m);
  archive.add_npz_array("do_optimize_intrinsics_core", solution.solved_parameters.core);
  archive.add_npz_array("do_optimize_intrinsics_distortions", problem.intrinsics.size() > 4);
  archive.add_npz_array("do_optimize_extrinsics", true);
  archive.add_npz_array("do_optimize_frames", true);
  archive.add_npz_array("do_optimize_calobject_warp", solution.solved_parameters.warp);
  archive.add_npz_array("do_apply_regularization", problem.intrinsics.size() > 4);
  archive.add_npz_array("do_apply_outlier_rejection", true);
  archive.add_npz_array("verbose", false);
  for (const char* none :
       {"points", "observations_point", "indices_point_camintrinsics_camextrinsics"}) {
    archive.add_npz_array(none, std::string_view());
  }
  return encode_base85(archive.serialize());
}

}  // namespace

void write_cameramodel(const std::filesystem::path& file, const IntrinsicsSolution& solution,
                       const ImageRegion& region) {
  const BoardProblem& problem = solution.problem;
  std::string text = "{\n    'lensmodel':  '";
  text.append(lens_model_name(problem.lens_model)).append("',\n    'intrinsics': [");
  for (const double value : problem.intrinsics) {
    text.append(" ").append(format_digits(value, kDigits)).append(",");
  }
  text += "],\n    'extrinsics': [ 0, 0, 0, 0, 0, 0 ],\n    'imagersize': [ ";
  text.append(std::to_string(problem.imager_px[0])).append(", ");
  text.append(std::to_string(problem.imager_px[1])).append(" ],\n    'icam_intrinsics': 0,\n");
  text.append(format_mrcal_region(region)).append("    'optimization_inputs': b'");
  text.append(format_optimization(solution)).append("',\n}\n");
  write_file(file, text);
}

namespace {

/// Returns unique names of the views in the table.
std::vector<std::string> make_names_unique(const IntrinsicsSolution& solution,
                                           std::span<const std::string> images) {
  std::vector<std::string> names;
  std::set<std::string> used_names;
  for (const std::size_t view : solution.views) {
    std::string name = images[view];
    std::ranges::replace(name, ' ', '_');
    std::string distinct_name = name;
    for (int n = 2; !used_names.insert(distinct_name).second; ++n)
      distinct_name = name + "-" + std::to_string(n);
    names.push_back(distinct_name);
  }
  return names;
}

}  // namespace

void write_mrcal_corners(const std::filesystem::path& file, const IntrinsicsSolution& solution,
                         std::span<const std::string> images) {
  const BoardProblem& problem = solution.problem;
  const std::size_t parts = problem.poses.size() / solution.views.size();
  const std::size_t count = problem.points_per_board();
  // mrcal truncates levels to integers from 0 on; an option makes it read weights instead.
  const bool weights = std::ranges::any_of(problem.points, [](const Eigen::Vector3d& point) {
    const double level = -std::log2(point.z());
    return point.z() > 0 && (level < 0 || level != std::floor(level));
  });
  const std::vector<std::string> names = make_names_unique(solution, images);
  std::string text = weights ? "# filename x y weight\n" : "# filename x y level\n";
  for (std::size_t board = 0; board < problem.poses.size(); ++board) {
    std::string name = names[board / parts];
    if (parts > 1) name += "-corner" + std::to_string(board % parts);
    for (std::size_t i = board * count; i < (board + 1) * count; ++i) {
      const Eigen::Vector3d& point = problem.points[i];
      text += name;
      if (point.z() > 0) {
        text.append(" ").append(format_digits(point.x(), kDigits));
        text.append(" ").append(format_digits(point.y(), kDigits)).append(" ");
        text.append(format_exact_number(weights ? point.z() : 0 - std::log2(point.z())))
            .append("\n");
      } else {
        text += " -1 -1 -\n";
      }
    }
  }
  write_file(file, text);
}

std::string get_mrcal_version() { return VLP_MRCAL_VERSION; }

}  // namespace vlp
