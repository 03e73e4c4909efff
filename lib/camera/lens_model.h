// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace vlp {

/// The lens models that the toolbox evaluates itself, with f = (fx, fy), c = (cx, cy) and the point
/// p = (x, y, z); the centre of the top-left pixel is (0, 0):
///   PINHOLE         pixel = f * (x/z, y/z) + c
///   STEREOGRAPHIC   pixel = f * 2 (x, y) / (|p| + z) + c
///   OPENCVn         pixel = f * distorted(x/z, y/z) + c  (camera/distortion.h)
///   OPENCV_FISHEYE  pixel = f * d(a) (x, y) / |(x, y)| + c,  a = atan2(|(x, y)|, z)
///                   (camera/fisheye.h)
/// and each of mrcal's splined lenses, by its name,
///   lens_model_from_name("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190"):
///                   pixel = f * distorted(2 (x, y) / (|p| + z)) + c  (camera/spline_surface.h)
/// All but OPENCV_FISHEYE are mrcal's LENSMODEL_... of the same names (mrcal documentation, "Lens
/// models"). Parameters are in mrcal's order,
///   fx fy cx cy  then, for OPENCVn, the first n of  k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4,
///   for OPENCV_FISHEYE  k1 k2 k3 k4,  for splined lenses the control points, x and y in turn, row
///   by row.
/// To add a model: an enumerator here, its row in lens_table.cpp, its equation in a header, and its
/// class in family_of() of lens.cpp.
enum class LensModel { pinhole, stereographic, opencv4, opencv5, opencv8, opencv12, fisheye };

/// mrcal's name, for example "LENSMODEL_OPENCV8", or "OPENCV_FISHEYE". It stays where it is.
std::string_view name_of(LensModel model);

/// The model of that name; nothing when the name is not one of the seven, nor that of a splined
/// lens as mrcal writes it, of order 2 or 3, with more control points each way than that and 255
/// at most, over 1 to 359 degrees.
std::optional<LensModel> lens_model_from_name(std::string_view name);

/// Every name, separated by commas, for messages; of the splined lenses one.
std::string lens_model_names();

/// Focal lengths, centre and distortion together: 4, 4, 8, 9, 12, 16 or 8; of a splined lens
/// 4 + 2 Nx Ny.
std::size_t parameter_count(LensModel model);

}  // namespace vlp
