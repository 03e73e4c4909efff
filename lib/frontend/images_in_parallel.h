// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace vlp {

/// in_parallel() over images, which take one thread each: OpenCV's own threads are switched off,
/// here and for the rest of the process, or there would be more than were asked for. `progress`,
/// which may be empty, gets how many are done, one call at a time.
void images_in_parallel(std::size_t count, int threads,
                        const std::function<void(std::size_t)>& look_at,
                        const std::function<void(std::size_t done)>& progress = {});

}  // namespace vlp
