// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// Folders of the project's data, for tests with VLP_SOURCE_DIR. Not inline: Clang 14 may
/// initialize inline variables after constants that use them.
const std::string kExample = VLP_SOURCE_DIR "/datasets/example/";
const std::string kRig = VLP_SOURCE_DIR "/datasets/paper-rig/rendered";

}  // namespace vlp
