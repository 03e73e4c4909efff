// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/pixel_runs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace vlp {
namespace {

std::vector<PixelRun> rows(int first, int last, int begin, int end) {
  std::vector<PixelRun> runs;
  for (int row = first; row <= last; ++row) runs.push_back({row, begin, end});
  return runs;
}

/// Joins runs, ordered by row, then by column, as find_pixel_runs() returns them.
std::vector<PixelRun> joined(const std::vector<std::vector<PixelRun>>& parts) {
  std::vector<PixelRun> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end(), [](const PixelRun& a, const PixelRun& b) {
    return a.row != b.row ? a.row < b.row : a.begin < b.begin;
  });
  return all;
}

TEST(GroupPixelRunsIntoBlobs, ReturnsNoBlobsWithoutRuns) {
  EXPECT_TRUE(group_pixel_runs_into_blobs({}, 5).empty());
}

TEST(GroupPixelRunsIntoBlobs, JoinsRunsAcrossAtMostMaxDarkRows) {
  for (const int dark : {0, 1, 5, 24}) {
    const auto runs = joined({rows(10, 14, 20, 40), rows(15 + dark, 19 + dark, 20, 40)});
    const auto whole = group_pixel_runs_into_blobs(runs, dark);
    ASSERT_EQ(whole.size(), 1U) << dark;
    EXPECT_EQ(whole[0].first_blob_row(), 10);
    EXPECT_EQ(whole[0].last_blob_row(), 19 + dark);
    EXPECT_EQ(whole[0].runs.size(), 10U);
    if (dark > 0) {
      EXPECT_EQ(group_pixel_runs_into_blobs(runs, dark - 1).size(), 2U) << dark;
    }
  }
}

TEST(GroupPixelRunsIntoBlobs, SeparatesLightsSideBySide) {
  const auto blobs =
      group_pixel_runs_into_blobs(joined({rows(10, 30, 20, 40), rows(5, 35, 40, 60)}), 5);
  ASSERT_EQ(blobs.size(), 2U);
  EXPECT_EQ(blobs[0].first_blob_row(), 5);
  EXPECT_EQ(blobs[0].runs.size(), 31U);
  EXPECT_EQ(blobs[1].first_blob_row(), 10);
  EXPECT_EQ(blobs[1].runs.size(), 21U);
}

TEST(GroupPixelRunsIntoBlobs, SeparatesHalvesOfLightBehindVerticalBar) {
  std::vector<vlp::PixelRun> runs;
  for (int row = -30; row <= 30; ++row) {
    const int half = static_cast<int>(std::sqrt(31 * 31 - row * row));
    if (half <= 3) continue;
    runs.push_back({50 + row, 100 - half, 97});
    runs.push_back({50 + row, 103, 100 + half});
  }
  const auto blobs = group_pixel_runs_into_blobs(runs, 5);
  ASSERT_EQ(blobs.size(), 2U);
  for (const Blob& blob : blobs) EXPECT_EQ(blob.runs.size(), runs.size() / 2);
  EXPECT_LE(blobs[0].runs[0].end, 97);
  EXPECT_GE(blobs[1].runs[0].begin, 103);
}

TEST(GroupPixelRunsIntoBlobs, JoinsBlobsConnectedByOneRun) {
  const auto runs = joined({rows(10, 20, 20, 40), rows(12, 20, 50, 70), rows(21, 22, 20, 70)});
  const auto blobs = group_pixel_runs_into_blobs(runs, 3);
  ASSERT_EQ(blobs.size(), 1U);
  EXPECT_EQ(blobs[0].first_blob_row(), 10);
  EXPECT_EQ(blobs[0].last_blob_row(), 22);
  EXPECT_EQ(blobs[0].runs.size(), runs.size());
}

TEST(GroupPixelRunsIntoBlobs, JoinsBlobsByRunOnlyIfBothEndWithinMaxDarkRows) {
  // A stripe of one blob ends before the run that joins both.
  const auto runs = joined({rows(10, 14, 20, 40), rows(10, 18, 50, 70), rows(19, 20, 35, 55)});
  EXPECT_EQ(group_pixel_runs_into_blobs(runs, 3).size(), 2U);
  EXPECT_EQ(group_pixel_runs_into_blobs(runs, 4).size(), 1U);
}

TEST(GroupPixelRunsIntoBlobs, ReturnsOneBlobForForkedLight) {
  const auto blobs = group_pixel_runs_into_blobs(
      joined({rows(10, 12, 20, 70), rows(13, 20, 20, 40), rows(13, 20, 50, 70)}), 3);
  ASSERT_EQ(blobs.size(), 1U);
  EXPECT_EQ(blobs[0].runs.size(), 19U);
}

TEST(GroupPixelRunsIntoBlobs, OrdersBlobsAndRunsByRowAndColumn) {
  const auto runs = joined({rows(10, 12, 60, 70), rows(10, 40, 20, 30), rows(3, 5, 90, 99),
                            rows(13, 20, 61, 130), rows(11, 12, 120, 125)});
  const auto blobs = group_pixel_runs_into_blobs(runs, 2);
  ASSERT_EQ(blobs.size(), 3U);
  ASSERT_EQ(blobs[0].runs.size(), 3U);
  ASSERT_EQ(blobs[1].runs.size(), 31U);
  ASSERT_EQ(blobs[2].runs.size(), 13U);
  EXPECT_EQ(blobs[0].runs[0].begin, 90);
  EXPECT_EQ(blobs[1].runs[0].begin, 20);
  EXPECT_EQ(blobs[2].runs[0].begin, 60);
  for (const Blob& blob : blobs) {
    for (std::size_t i = 1; i < blob.runs.size(); ++i) {
      const vlp::PixelRun &a = blob.runs[i - 1], &b = blob.runs[i];
      EXPECT_TRUE(a.row < b.row || (a.row == b.row && a.begin < b.begin));
    }
  }
}

}  // namespace
}  // namespace vlp
