// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace vlp {

/// Calls task(0) to task(count - 1), each once and in any order, and returns when all have ended.
/// Runs on up to `threads` threads, including the calling one. The first exception of a task
/// prevents further calls and is rethrown.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& task);

}  // namespace vlp
