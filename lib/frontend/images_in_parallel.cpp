// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/images_in_parallel.h"

#include <mutex>
#include <opencv2/core/utility.hpp>

#include "captures/parallel_for.h"

namespace vlp {

void images_in_parallel(std::size_t count, int threads,
                        const std::function<void(std::size_t)>& process,
                        const std::function<void(std::size_t done)>& progress) {
  cv::setNumThreads(1);
  std::mutex counting;
  std::size_t done = 0;
  parallel_for(count, threads, [&](std::size_t i) {
    process(i);
    if (!progress) return;
    const std::lock_guard lock(counting);
    progress(++done);
  });
}

}  // namespace vlp
