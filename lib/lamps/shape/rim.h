// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/runs.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_shape.h"

namespace vlp {

/// Returns whether a blob is much brighter inside than next to its outline: three times in one line
/// of ten.
bool unevenly_lit(const ImageView& image, const Blob& blob, const std::vector<EdgePoint>& outline,
                  const Background& background);

/// A light by its rim, and whether the rim is clear: most pieces of it show a step, or the outline
/// without any one of eight pieces still has a centre.
struct Rim {
  Light light;
  bool clear;
};

/// Fits the rim of a light that is lit unevenly, as a source deep in a reflector is seen: its core
/// is ten times as bright as its rim or more and moves with the point of view, a part of the rim is
/// dark, and the ceiling around it is lit. A rim shows as a step, not as a level. With the mean
/// levels of a few pixels of a line outside a border, o, inside, i, and behind those, b, and with
/// c, half of the noise threshold and at least 2 % of the brightest level, the step is
///
///     e = log((i + c) / (o + c)) - max(0, log((b + c) / (i + c))),   from -0.7 to 1.
///
/// 1. Search: of circles in the level plane the one whose crossings with the lit lines have the
///    largest sum of e, 0.28 on average or more. (Daugman 1993 sums steps of irises.) Circles in
///    the image would follow a part of a rim that is seen from the side.
/// 2. Circle, or ellipse without a lens, through the clearest steps near it.
/// 3. Steps fitted to the pixels next to it, see fit_rim_steps(): if 60 % of its pieces show one,
///    the rim is where they are, and the sigma of its centre is theirs, with the shift that another
///    tone curve causes. Otherwise sigma is the larger one of the scatter of the points and the
///    jackknife over eight pieces of the outline.
///
/// Returns std::nullopt if the blob is smaller than 20 px or has less than 10 lit lines, if no
/// circle has such steps, or if the steps determine no circle.
std::optional<Rim> rim_of(const ImageView& image, const Blob& blob, const Background& background,
                          const LightShape& shape);

}  // namespace vlp
