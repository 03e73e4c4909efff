// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/corner_cache.h"

#include <gmock/gmock.h>

#include "rig/board.h"
#include "support/datasets.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Files of the cache do not wait for the disk: a power cut may leave the first lines of one.
TEST(CornerCache, TakesNoFileThatLacksLines) {
  const fs::path rig = kRig;
  const TemporaryFolder folder;
  const Board board = read_board(rig / "board.yaml");
  const BoardDetector detector(board);
  const auto view = [&] {
    ImageSource source({rig / "sample-boards/0000.png"});
    return detect_boards(detector, source, 1, corner_cache(folder / "cache", board), [](auto) {})
        .views.at(0);
  };
  const BoardView whole = view();
  ASSERT_GE(whole.seen.tags.size(), 20U);
  const fs::path kept = fs::directory_iterator(folder / "cache")->path();
  const std::string text = TemporaryFolder::content_of(kept);
  std::size_t ends = 0;
  for (std::size_t end = text.find('\n'); end != std::string::npos;
       end = text.find('\n', end + 1)) {
    if (++ends % 9 != 1) continue;
    fs::resize_file(kept, end + 1);
    const BoardView again = view();
    ASSERT_EQ(again.seen.tags.size(), whole.seen.tags.size()) << ends << " lines";
    EXPECT_EQ(again.seen.tags.back().corners_px, whole.seen.tags.back().corners_px);
    EXPECT_EQ(TemporaryFolder::content_of(kept), text);
  }
}

}  // namespace
}  // namespace vlp
