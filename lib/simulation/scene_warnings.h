// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "simulation/scene.h"

namespace vlp {

/// Returns warnings about conditions that make the captures of a set useless though the scene is
/// valid. Each is one line that begins with the folder.
///
/// Covers images that are nearly black or white, exposures that blur the stripes, and stripes that
/// are too fine.
std::vector<std::string> find_warnings(const Scene& scene, const CaptureSet& set);

}  // namespace vlp
