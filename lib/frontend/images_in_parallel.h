// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace vlp {

/// Calls look_at(i) for each image i < `count` on `threads` threads, as in_parallel() does.
/// Switches OpenCV's own threads off for the rest of the process, so that no more than `threads`
/// run.
///
/// @param progress  called with the number of images done; calls do not overlap; may be empty
void images_in_parallel(std::size_t count, int threads,
                        const std::function<void(std::size_t)>& look_at,
                        const std::function<void(std::size_t done)>& progress = {});

}  // namespace vlp
