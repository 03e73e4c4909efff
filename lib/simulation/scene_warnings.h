// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "simulation/scene.h"

namespace vlp {

/// What makes the captures of a set useless though the scene is valid, each in one line that begins
/// with the folder: images nearly black or white, an exposure that blurs the stripes, stripes too
/// fine to see.
std::vector<std::string> warnings_about(const Scene& scene, const CaptureSet& set);

}  // namespace vlp
