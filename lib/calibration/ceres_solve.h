// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/ceres.h>
#include <glog/logging.h>

namespace vlp {

/// Solves a least-squares problem in one thread, which keeps the order of sums and so their
/// rounding, and without messages on stderr.
///
/// @return  true if the solution is usable
inline bool solve_with_ceres(ceres::Solver::Options options, ceres::Problem& problem) {
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  FLAGS_minloglevel = google::GLOG_FATAL;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable();
}

}  // namespace vlp
