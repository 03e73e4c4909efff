// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
// The only file that includes headers of mrcal. They lack extern "C" before version 2.4, so that
// the headers that they include must come first.
#include <stdbool.h>
#include <stdint.h>

#include <string>
#include <type_traits>
extern "C" {
#include <mrcal/mrcal.h>
#include <suitesparse/cholmod.h>
}

#include <fcntl.h>
#include <unistd.h>

#include <limits>
#include <mutex>
#include <span>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "calibration/intrinsics/mrcal_library.h"

namespace vlp {
namespace {

static_assert(sizeof(BoardPose) == sizeof(mrcal_pose_t));
static_assert(sizeof(Eigen::Vector3d) == sizeof(mrcal_point3_t));
static_assert(sizeof(Eigen::Vector2d) == sizeof(mrcal_calobject_warp_t));

/// Arguments of mrcal for a problem.
struct Arguments {
  /// `fixed_rays`: rays of the problem, as points that do not move.
  Arguments(const BoardProblem& problem, const SolveOptions& solve_options,
            std::span<const BoardProblem::FixedRay> fixed_rays = {})
      : frames(static_cast<int>(problem.poses.size())), fixed(static_cast<int>(fixed_rays.size())) {
    const std::string name(lens_model_name(problem.lens_model));
    if (!mrcal_lensmodel_from_name(&lens, name.c_str())) {
      // [LENS-7] `mrcal does not support`
      throw std::runtime_error("mrcal does not support " + name);
    }
    selections.do_optimize_intrinsics_core = solve_options.core;
    selections.do_optimize_intrinsics_distortions = solve_options.distortions;
    selections.do_optimize_frames = true;
    selections.do_optimize_calobject_warp = solve_options.warp;
    selections.do_apply_regularization = solve_options.distortions;
    selections.do_apply_outlier_rejection = solve_options.reject_outliers;
    for (int frame = 0; frame < frames; ++frame) observations.push_back({{0, -1}, frame});
    for (const auto& [pixel, ray] : fixed_rays) {
      mrcal_observation_point_t seen{{0, -1}, static_cast<int>(points.size()), {}};
      seen.px.x = pixel.x(), seen.px.y = pixel.y(), seen.px.z = 1 / problem.noise_px;
      point_observations.push_back(seen);
      mrcal_point3_t unit{};
      Eigen::Map<Eigen::Vector3d>(unit.xyz) = ray.normalized();
      points.push_back(unit);
    }
    constants.point_min_range = 0.1;  // 1 is between
    constants.point_max_range = 10;
    measurements = mrcal_num_measurements(frames, fixed, problem.cols, problem.rows, 1, 0, frames,
                                          fixed, fixed, selections, &lens);
    states = mrcal_num_states(1, 0, frames, fixed, fixed, frames, selections, &lens);
  }

  int frames, fixed;
  mrcal_lensmodel_t lens{};
  mrcal_problem_selections_t selections{};
  mrcal_problem_constants_t constants{};
  std::vector<mrcal_observation_board_t> observations;
  std::vector<mrcal_point3_t> points;
  std::vector<mrcal_observation_point_t> point_observations;
  int measurements, states;
};

int bytes(Eigen::Index doubles) { return static_cast<int>(doubles) * int(sizeof(double)); }

/// Returns the points with weights for which the noise of the corners is one pixel.
std::vector<Eigen::Vector3d> weight_points(const BoardProblem& problem) {
  auto points = problem.points;
  for (Eigen::Vector3d& point : points) {
    if (point.z() != BoardProblem::kUnseen) point.z() *= 1 / problem.noise_px;
  }
  return points;
}

/// Calls an unpack function of mrcal, which has one more argument since version 2.4.
template <typename Unpack>
void unpack_mrcal_state(Unpack* function, double* state, const Arguments& args) {
  if constexpr (std::is_invocable_v<Unpack*, double*, int, int, int, int, int, int,
                                    mrcal_problem_selections_t, const mrcal_lensmodel_t*>) {
    function(state, 1, 0, args.frames, 0, 0, args.frames, args.selections, &args.lens);
  } else {
    function(state, 1, 0, args.frames, 0, 0, args.selections, &args.lens);
  }
}

/// Runs `work` without the messages of mrcal on stderr, where it always reports outliers.
///
/// The work runs in a thread with its own table of open files, in which stderr is /dev/null.
/// Redirecting stderr of the process would discard messages of other threads. If the system does
/// not grant that, or no thread, the messages of mrcal appear. Calls are sequential, because mrcal
/// does not document concurrent use.
template <typename Work>
void run_silently(const Work& work) {
  static std::mutex mrcal_mutex;
  const std::lock_guard lock(mrcal_mutex);
  const auto silent_work = [&] {
    // Closes the other files, so that files which other threads close do not stay open here.
    constexpr unsigned first = STDERR_FILENO + 1, last = std::numeric_limits<unsigned>::max();
    if (::close_range(first, last, CLOSE_RANGE_UNSHARE) == 0) {
      const int null_device = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
      if (null_device >= 0) ::dup2(null_device, STDERR_FILENO);
    }
    work();
  };
  try {
    std::thread(silent_work).join();
  } catch (const std::system_error&) {
    work();
  }
}

bool solve_with_mrcal(BoardProblem& problem, const SolveOptions& solve_options) {
  Arguments args(problem, solve_options, problem.fixed_rays);
  if (args.measurements < args.states) return false;
  Eigen::VectorXd state(args.states), residuals(args.measurements);
  auto points = weight_points(problem);
  mrcal_stats_t stats{};
  run_silently([&] {
    stats = mrcal_optimize(
        state.data(), bytes(state.size()), residuals.data(), bytes(residuals.size()),
        problem.intrinsics.data(), nullptr, reinterpret_cast<mrcal_pose_t*>(problem.poses.data()),
        args.points.data(), reinterpret_cast<mrcal_calobject_warp_t*>(problem.warp_m.data()), 1, 0,
        args.frames, args.fixed, args.fixed, args.observations.data(),
        args.point_observations.data(), args.frames, args.fixed,
        reinterpret_cast<mrcal_point3_t*>(points.data()), &args.lens, problem.imager_px.data(),
        args.selections, &args.constants, problem.spacing_m, problem.cols, problem.rows, false,
        false);
  });
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].z() < 0 && problem.points[i].z() > 0) problem.points[i].z() *= -1;
  }
  return stats.rms_reproj_error__pixels >= 0 && residuals.allFinite();
}

Linearization linearize_with_mrcal(const BoardProblem& problem, const SolveOptions& solve_options) {
  const Arguments args(problem, solve_options);
  const int entries =
      _mrcal_num_j_nonzero(args.frames, 0, problem.cols, problem.rows, 1, 0, args.frames, 0, 0,
                           args.observations.data(), nullptr, args.selections, &args.lens);
  Linearization result;
  Eigen::VectorXd state(args.states), residuals(args.measurements);
  std::vector<int> column_pointers(static_cast<std::size_t>(args.measurements) + 1);
  std::vector<int> rows(static_cast<std::size_t>(entries));
  std::vector<double> values(static_cast<std::size_t>(entries));
  const auto points = weight_points(problem);
  cholmod_sparse jacobian{};
  jacobian.nrow = static_cast<std::size_t>(args.states);
  jacobian.ncol = static_cast<std::size_t>(args.measurements);
  jacobian.nzmax = static_cast<std::size_t>(entries);
  jacobian.p = column_pointers.data();
  jacobian.i = rows.data();
  jacobian.x = values.data();
  jacobian.itype = CHOLMOD_INT;
  jacobian.xtype = CHOLMOD_REAL;
  jacobian.dtype = CHOLMOD_DOUBLE;
  jacobian.sorted = 1;
  jacobian.packed = 1;
  bool ok = false;
  run_silently([&] {
    ok = mrcal_optimizer_callback(
        state.data(), bytes(state.size()), residuals.data(), bytes(residuals.size()), &jacobian,
        problem.intrinsics.data(), nullptr,
        reinterpret_cast<const mrcal_pose_t*>(problem.poses.data()), nullptr,
        reinterpret_cast<const mrcal_calobject_warp_t*>(problem.warp_m.data()), 1, 0, args.frames,
        0, 0, args.observations.data(), nullptr, args.frames, 0,
        reinterpret_cast<const mrcal_point3_t*>(points.data()), &args.lens,
        problem.imager_px.data(), args.selections, &args.constants, problem.spacing_m, problem.cols,
        problem.rows, false);
  });
  if (!ok) throw std::runtime_error("mrcal_optimizer_callback failed");
  // Scales everything back to pixels.
  residuals *= problem.noise_px;
  for (double& value : values) value *= problem.noise_px;
  const int num_board_residuals =
      mrcal_num_measurements_boards(args.frames, problem.cols, problem.rows);
  result.residuals_px = residuals.head(num_board_residuals);
  result.regularization = residuals.tail(residuals.size() - num_board_residuals);
  result.jacobian_transposed = Eigen::Map<const Eigen::SparseMatrix<double>>(
      args.states, args.measurements, column_pointers.back(), column_pointers.data(), rows.data(),
      values.data());
  result.scale.setOnes(args.states);
  unpack_mrcal_state(mrcal_unpack_solver_state_vector, result.scale.data(), args);
  constexpr Eigen::Index core = 4;
  result.first_intrinsic = solve_options.core ? 0 : core;
  result.poses = mrcal_state_index_frames(0, 1, 0, args.frames, 0, 0, args.frames, args.selections,
                                          &args.lens);
  return result;
}

}  // namespace
}  // namespace vlp

/// The function that mrcal_library.cpp calls.
extern "C" __attribute__((visibility("default"))) const vlp::MrcalFunctions* vlp_mrcal_functions() {
  static constexpr vlp::MrcalFunctions functions{&vlp::solve_with_mrcal,
                                                 &vlp::linearize_with_mrcal};
  return &functions;
}
