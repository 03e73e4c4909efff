// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace vlp {

/// Calls task(0) to task(count - 1), each once, on `threads` threads (at least one), including the
/// calling one. The first exception stops further calls and is thrown here.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& task);

}  // namespace vlp
