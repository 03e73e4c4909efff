// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_source.h"

#include <gtest/gtest.h>

#include <opencv2/core/utility.hpp>
#include <vector>

namespace vlp {
namespace {

TEST(ProcessImages, RunsTaskOncePerImageWithOneOpencvThread) {
  cv::setNumThreads(4);
  constexpr std::size_t count = 50;
  std::vector<int> times(count), threads(count);
  std::vector<std::size_t> done;
  process_images(
      count, 3,
      [&](std::size_t i) {
        ++times[i];
        threads[i] = cv::getNumThreads();
      },
      [&](std::size_t so_far) { done.push_back(so_far); });
  EXPECT_EQ(times, std::vector<int>(count, 1));
  EXPECT_EQ(threads, std::vector<int>(count, 1));
  ASSERT_EQ(done.size(), count);
  for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(done[i], i + 1);
}

}  // namespace
}  // namespace vlp
