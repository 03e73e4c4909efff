// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace vlp {

/// Calls process(i) for each image i < `count` on `threads` threads, as parallel_for() does.
/// Switches OpenCV's own threads off for the rest of the process, so that no more than `threads`
/// run.
///
/// @param progress  called with the number of images done; calls do not overlap; may be empty
void images_in_parallel(std::size_t count, int threads,
                        const std::function<void(std::size_t)>& process,
                        const std::function<void(std::size_t done)>& progress = {});

}  // namespace vlp
