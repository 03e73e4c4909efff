// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lamps/image/pixel_box.h"
#include "lamps/shape/light.h"

namespace vlp {

/// Returns the standard deviation per axis, in pixels, of the centre of a disc's outline by an
/// unknown lens.
///
/// The ellipse through the outline of a disc is not centred on the image of its centre. A lens that
/// shows a ray of slope r at the distance f g(r) from its axis moves the one from the other by
///
///     f q^2 (3/8 g'' + 1/8 (g' / r - g / r^2) + 1/4 g' (g' / g - 1 / r)),
///
/// with q the disc's radius as a slope: the first harmonic of what the second order of g does to
/// the outline. For g = r - k r^3 that is 3 k a^2 R / f^2, with a the outline's radius and R its
/// distance from the axis, both in pixels; for the equidistant lens, g = atan r and k = 1/3, at
/// most a^2 R / f^2 at any distance from the axis. A camera tilt t shifts it by a^2 tan(t) / f
/// (Heikkila and Silven 1997).
///
/// The bound is an equidistant lens of 115 degrees from corner to corner, so that f is half of the
/// image's diagonal, on a camera tilted by 10 degrees, and it is taken for one standard deviation
/// of the shift. Lenses of consumer cameras distort less, a fisheye of 180 degrees up to 2.5 times
/// as much. 0 for rectangles, because the bow of their edges determines it.
double unknown_lens_sd_px(const Light& light, const ImageSize& image);

}  // namespace vlp
