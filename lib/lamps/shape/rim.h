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

/// Whether a blob is much brighter inside than next to its outline: three times in one line of ten.
bool unevenly_lit(const ImageView& image, const Blob& blob, const std::vector<EdgePoint>& outline,
                  const Background& background);

/// A light by its rim, and whether the rim is clear: a glow without one has slopes that may pass
/// for a faint one.
struct Rim {
  Light light;
  bool clear;
};

/// A light that is lit unevenly, by its rim, as a source deep in a reflector is seen: its core is
/// ten times as bright as its rim or more and moves with the point of view, a part of the rim is
/// dark, and the ceiling around it is lit. What tells the rim is not a level but a step, and of a
/// step the ratio, less that of the slope behind it: with the mean levels of a few pixels of a line
/// outside a border, o, inside, i, and behind those, b, and with c, half of what noise reaches and
/// 2 % of the brightest level at least,
///
///     e = log((i + c) / (o + c)) - max(0, log((b + c) / (i + c))),   from -0.7 to 1.
///
/// The rim is the circle whose crossings with the lit lines have the largest sum of e (Daugman 1993
/// has this of irises, with levels), then the ellipse through the steps near it. It is clear when e
/// is a third on average and half of the crossings show a step; nothing below 0.28. Then steps are
/// fitted to the pixels next to it, see fit_rim_steps(): the rim is where they are, and clear where
/// most of it has one. The sigma of its centre is theirs, with what another tone curve would make
/// of it; of a rim that is not clear by them and where another circle has nearly that sum, the
/// distance to it by the odds that it is the rim, too.
std::optional<Rim> rim_of(const ImageView& image, const Blob& blob, const Background& background,
                          const LightShape& shape);

}  // namespace vlp
