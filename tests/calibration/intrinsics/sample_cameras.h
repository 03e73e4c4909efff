// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calibration/intrinsics/camera_imports.h"
#include "camera/spline_grid.h"

namespace vlp {

/// Returns a camera of 800 x 600 px with any model that is not splined.
inline Camera make_camera(LensModel model) {
  const std::vector<double> distortions{-0.2,   0.05,  1e-4, -2e-4, 0.01,  0.02,
                                        -0.003, 0.001, 1e-4, 2e-5,  -1e-4, 3e-5};
  Camera camera{"camera", {800, 600}, model, {520.25, 521, 402.3, 297.4}, {}, {}, {}};
  if (model == LensModel::fisheye) {  // up to 104 degrees off the axis
    camera.intrinsics = {290, 291, 402, 297, 0.03, -0.012, 0.004, -0.0006};
    return camera;
  }
  camera.intrinsics.insert(
      camera.intrinsics.end(), distortions.begin(),
      distortions.begin() + static_cast<std::ptrdiff_t>(num_lens_parameters(model) - 4));
  return camera;
}

/// Returns a camera with a splined lens like one of 150 degrees.
inline Camera splined_camera(const SplineGrid& grid = {3, 13, 11, 150}) {
  return convert_lens_model(make_camera(LensModel::fisheye), splined_lens_model(grid)).camera;
}

}  // namespace vlp
