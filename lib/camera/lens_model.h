// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace vlp {

/// The lens models that the toolbox evaluates itself: those of mrcal, with their parameters in
/// mrcal's order,
///   fx fy cx cy  then, for OPENCVn, the first n of  k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4,
/// and OPENCV_FISHEYE, which mrcal does not have:  fx fy cx cy k1 k2 k3 k4  (camera/fisheye.h).
/// Each of mrcal's splined lenses is one more, by its name,
///   lens_model_from_name("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190"),
/// of fx fy cx cy and the control points, x and y in turn, row by row.
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
