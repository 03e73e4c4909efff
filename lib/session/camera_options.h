// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "session/session.h"

namespace vlp {

/// Returns the options of the camera as text for the history.
std::string format_camera_options(const SessionOptions& options);

/// Returns the names of the changed options of the camera, such as "name, row time"; empty if none
/// is changed.
std::string list_changed_camera_options(const SessionOptions& options);

}  // namespace vlp
