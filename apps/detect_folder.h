// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "detection/detect_captures.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// The lamps in a folder of images, on all cores, with progress and a warning for each image that
/// is skipped. The names of the files are for messages; `output` must not be one of the images.
/// Throws InputError: no row time, no frequency, no image; Undetermined when no lamp is identified.
CaptureDetections detect_folder(const std::string& folder, const LampMap& lamps,
                                const std::string& lamps_file, const Calibration& calibration,
                                const std::string& calibration_file, const std::string& output,
                                int threads);

/// The captures of a detections.csv, or of a folder of images: detect_folder() on all cores.
std::vector<Frame> frames_of(const std::string& captures, const LampMap& lamps,
                             const std::string& lamps_file, const Calibration& calibration,
                             const std::string& calibration_file, const std::string& output);

/// How many threads there are when nobody says so.
int all_cores();

}  // namespace vlp
