// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace vlp {

/// Lens models that the toolbox evaluates itself, with f = (fx, fy), c = (cx, cy) and the point
/// p = (x, y, z). The center of the top-left pixel is (0, 0).
///   PINHOLE         pixel = f * (x/z, y/z) + c
///   STEREOGRAPHIC   pixel = f * 2 (x, y) / (|p| + z) + c
///   OPENCVn         pixel = f * distort_point(x/z, y/z) + c  (camera/distortion.h)
///   OPENCV_FISHEYE  pixel = f * d(a) (x, y) / |(x, y)| + c,  a = atan2(|(x, y)|, z)
///                   (camera/fisheye.h)
///   splined         pixel = f * distort_point(2 (x, y) / (|p| + z)) + c  (camera/spline_surface.h)
/// Each grid of mrcal's splined lenses is a model; lens_model_from_name() returns it by its name,
/// for example "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190". All models
/// except OPENCV_FISHEYE are mrcal's LENSMODEL_... of the same names (mrcal documentation, "Lens
/// models").
///
/// Parameters are in mrcal's order: fx fy cx cy, followed by
///   OPENCVn         the first n of  k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4
///   OPENCV_FISHEYE  k1 k2 k3 k4
///   splined         the control points row by row, x before y
///
/// A new model needs an enumerator here, a row in lens_table.cpp, its equation in a header and a
/// class in make_lens_family() of lens.cpp.
enum class LensModel { pinhole, stereographic, opencv4, opencv5, opencv8, opencv12, fisheye };

/// Returns the name of a lens model: mrcal's name, for example "LENSMODEL_OPENCV8", or
/// "OPENCV_FISHEYE" for `fisheye`. The view stays valid until the program ends.
std::string_view lens_model_name(LensModel model);

/// Returns the model with this name (lens_model_name()); std::nullopt for other names. A splined
/// lens must be within the bounds of SplineGrid, and its name written as mrcal writes it.
std::optional<LensModel> lens_model_from_name(std::string_view name);

/// Returns all names, separated by commas, for messages. One example stands for the splined lenses.
std::string list_lens_model_names();

/// Returns the number of parameters (focal lengths, principal point and distortions), in the order
/// of LensModel: 4, 4, 8, 9, 12, 16, 8; 4 + 2 Nx Ny for a splined lens.
std::size_t num_lens_parameters(LensModel model);

}  // namespace vlp
