// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/board_intake.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "frontend/image_file.h"
#include "support/datasets.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

namespace fs = std::filesystem;

/// A folder for images of the board of the paper's rig.
struct BoardIntakeOfFolder : testing::Test {
  Board board = read_board(kRig + "/board.yaml");
  TemporaryFolder folder;
  cv::Mat good = read_image(kRig + "/sample-boards/0000.png");
  cv::Mat other;  // upside down
  FrontendOptions options;

  BoardIntakeOfFolder() { cv::rotate(good, other, cv::ROTATE_180); }

  fs::path write(const char* name, const cv::Mat& image) const {
    cv::imwrite((folder / name).string(), image);
    return folder / name;
  }
  /// Returns the observation of an image with these pixels.
  Observation observe(const cv::Mat& image) const {
    return BoardIntake(board, options, std::array{good.cols, good.rows})
        .detect_board(SourceImage(write("image.png", image)));
  }
  Observations observe_all() const {
    return detect_boards(list_images(folder / ""), board, "board.yaml", options);
  }
};

RejectionReason rejection_reason(const Observation& image) {
  EXPECT_TRUE(image.rejection) << image.image_file_name() << " is not rejected";
  return image.rejection ? image.rejection->reason : RejectionReason::not_needed;
}

cv::Mat scaled(const cv::Mat& image, double factor) {
  cv::Mat result;
  image.convertTo(result, CV_8U, factor);
  return result;
}

TEST_F(BoardIntakeOfFolder, KeepsSharpImage) {
  const Observation image = observe(good);
  EXPECT_TRUE(image.is_image_kept()) << image.rejection->message;
  ASSERT_TRUE(image.board);
  EXPECT_GE(image.board->detection.tags.size(), 20U);
  EXPECT_EQ(image.size_px, (std::array{800, 600}));
  ASSERT_TRUE(image.blur_px);
  EXPECT_LT(*image.blur_px, 1.5);
}

TEST_F(BoardIntakeOfFolder, RejectsBlurredDarkOverexposedUniformOrWronglySizedImages) {
  cv::Mat blurred;
  cv::GaussianBlur(good, blurred, {}, 3);
  const Observation blur = observe(blurred);
  EXPECT_EQ(rejection_reason(blur), RejectionReason::blurred);
  ASSERT_TRUE(blur.rejection);
  EXPECT_THAT(blur.rejection->message,
              testing::MatchesRegex("blurred: [23]\\.[0-9] px, 2\\.4 .*--max-blur-fraction.*"));

  const Observation dark = observe(scaled(good, 0.012));
  EXPECT_EQ(rejection_reason(dark), RejectionReason::too_dark);
  ASSERT_TRUE(dark.rejection);
  EXPECT_THAT(dark.rejection->message, HasSubstr("of the full scale, 10 % at least"));

  const Observation white = observe(scaled(good, 30));
  EXPECT_EQ(rejection_reason(white), RejectionReason::overexposed);
  ASSERT_TRUE(white.rejection);
  EXPECT_THAT(white.rejection->message, AllOf(HasSubstr("is at full scale, 25 % at most"),
                                              HasSubstr("--max-white-fraction")));

  EXPECT_EQ(rejection_reason(observe(cv::Mat1b(600, 800, uchar(128)))),
            RejectionReason::no_contrast);
  EXPECT_EQ(rejection_reason(observe(good(cv::Rect(0, 0, 400, 300)))), RejectionReason::wrong_size);
}

/// Corners of tags in moderately overexposed images are accurate, which their standard deviations
/// report.
TEST_F(BoardIntakeOfFolder, KeepsOverexposedImageWithAccurateCornersAndStatesDoubt) {
  const Observation white = observe(scaled(good, 2.5));
  ASSERT_TRUE(white.is_image_kept()) << white.rejection->message;
  EXPECT_THAT(white.doubt, testing::MatchesRegex("overexposed: [0-9]+ % of the board is at full "
                                                 "scale; used, as its corners have .* px"));
  const Observation sharp = observe(good);
  EXPECT_EQ(sharp.doubt, "");
  const auto expected = collect_detected_corners(sharp.board->detection);
  std::size_t compared = 0;
  for (const PointDetection& corner : collect_detected_corners(white.board->detection)) {
    const auto same = std::ranges::find(expected, corner.index, &PointDetection::index);
    if (same == expected.end()) continue;
    EXPECT_LT((corner.pixel - same->pixel).norm(), 0.3) << corner.index;
    ++compared;
  }
  EXPECT_GE(compared, 80U);
}

/// Half a bit of a tag has to be wider than the blur, whatever the size of the image.
TEST_F(BoardIntakeOfFolder, RejectsBlurThatIsLargeForTags) {
  cv::Mat image;
  cv::resize(good, image, {}, 0.6, 0.6, cv::INTER_AREA);
  cv::copyMakeBorder(image, image, 0, good.rows - image.rows, 0, good.cols - image.cols,
                     cv::BORDER_REPLICATE);
  cv::GaussianBlur(image, image, {}, 1.4);
  const Observation blurred = observe(image);
  ASSERT_TRUE(blurred.board);
  ASSERT_TRUE(blurred.board->detection.has_corners());
  EXPECT_EQ(rejection_reason(blurred), RejectionReason::blurred);
  ASSERT_TRUE(blurred.rejection);
  EXPECT_THAT(blurred.rejection->message, HasSubstr("at most for tags of"));
}

TEST_F(BoardIntakeOfFolder, RejectsImageBlurredBeyondMaxBlurOfOptions) {
  cv::Mat blurred;
  cv::GaussianBlur(good, blurred, {}, 1.5);
  ASSERT_TRUE(observe(blurred).is_image_kept());
  options.max_blur_fraction = 0.00125;
  EXPECT_EQ(rejection_reason(observe(blurred)), RejectionReason::blurred);
}

TEST_F(BoardIntakeOfFolder, RejectsImagesWithTwoOrNoTags) {
  // Some tags are left, then none.
  cv::Mat few = good.clone(), none = good.clone();
  const BoardDetection seen = BoardDetector(board).detect_board(good);
  ASSERT_GE(seen.tags.size(), 6U);
  const auto hide = [](const TagDetection& tag, cv::Mat& image) {
    std::vector<cv::Point> corners;
    for (const auto& corner : tag.corners_px) corners.emplace_back(corner.x(), corner.y());
    cv::fillConvexPoly(image, corners, cv::Scalar(255));
  };
  for (std::size_t i = 0; i < seen.tags.size(); ++i) {
    if (i > 1) hide(seen.tags[i], few);
    hide(seen.tags[i], none);
  }
  const Observation image = observe(few);
  EXPECT_EQ(rejection_reason(image), RejectionReason::too_few_corners);
  ASSERT_TRUE(image.rejection);
  EXPECT_THAT(image.rejection->message, StartsWith("only 2 tags of the board can be used"));
  cv::rectangle(none, {100, 100, 80, 80}, cv::Scalar(0), -1);  // sharp edges
  EXPECT_EQ(rejection_reason(observe(none)), RejectionReason::no_board);
}

TEST_F(BoardIntakeOfFolder, RejectsImageWithTagsOfOtherBoard) {
  const Observation before = observe(good);
  ASSERT_TRUE(before.is_image_kept());
  board.first_id += 100;
  const Observation image = observe(good);
  EXPECT_EQ(rejection_reason(image), RejectionReason::other_board);
}

TEST_F(BoardIntakeOfFolder, ReturnsSameCornersWithOneAndFourThreads) {
  for (const char* name : {"a.png", "b.png", "c.png", "d.png"}) write(name, good);
  write("e.png", other);
  folder.file("bad.png", "no image");
  std::size_t last = 0;
  const Observations one = observe_all();
  options.threads = 4;
  const Observations four = detect_boards(list_images(folder / ""), board, "board.yaml", options,
                                          [&](std::size_t done, std::size_t total) {
                                            last = done;
                                            EXPECT_EQ(total, 6U);
                                          });
  EXPECT_EQ(last, 6U);
  ASSERT_EQ(four.images.size(), 6U);
  ASSERT_EQ(one.images.size(), 6U);
  int compared = 0;
  for (std::size_t i = 0; i < one.images.size(); ++i) {
    EXPECT_EQ(one.images[i].image_file_name(), four.images[i].image_file_name());
    ASSERT_EQ(one.images[i].is_image_kept(), four.images[i].is_image_kept())
        << one.images[i].image_file_name();
    ASSERT_EQ(one.images[i].board.has_value(), four.images[i].board.has_value());
    if (!one.images[i].board) continue;
    const auto &tags = one.images[i].board->detection.tags,
               &others = four.images[i].board->detection.tags;
    ASSERT_FALSE(tags.empty());
    ASSERT_EQ(tags.size(), others.size());
    ++compared;
    for (std::size_t k = 0; k < tags.size(); ++k) {
      EXPECT_EQ(tags[k].corners_px, others[k].corners_px);
    }
  }
  EXPECT_GT(compared, 0);
}

TEST_F(BoardIntakeOfFolder, RejectsRepeatedImagesAndViews) {
  write("a.png", good);
  write("b.png", good);
  cv::Mat moved;
  cv::warpAffine(good, moved, cv::Mat(cv::Matx23d(1, 0, 3, 0, 1, 1)), good.size(), cv::INTER_LINEAR,
                 cv::BORDER_REPLICATE);
  write("c.png", moved);
  write("d.png", other);
  const Observations seen = observe_all();
  ASSERT_EQ(seen.images.size(), 4U);
  EXPECT_TRUE(seen.images[0].is_image_kept());
  EXPECT_EQ(rejection_reason(seen.images[1]), RejectionReason::same_image);
  ASSERT_TRUE(seen.images[1].rejection && seen.images[2].rejection);
  EXPECT_EQ(seen.images[1].rejection->message, "is the same image as a.png");
  EXPECT_EQ(rejection_reason(seen.images[2]), RejectionReason::same_view);
  EXPECT_EQ(seen.images[2].rejection->message, "shows the same view as a.png: views count once");
  EXPECT_TRUE(seen.images[3].is_image_kept());
  EXPECT_FALSE(seen.failure);
  EXPECT_EQ(collect_board_views(seen.images).size(), 2U);
}

TEST_F(BoardIntakeOfFolder, RejectsImagesOfMinoritySize) {
  write("a.png", good(cv::Rect(0, 0, 700, 600)));
  write("b.png", good);
  write("c.png", other);
  const Observations seen = observe_all();
  ASSERT_EQ(seen.images.size(), 3U);
  EXPECT_EQ(rejection_reason(seen.images[0]), RejectionReason::wrong_size);
  ASSERT_TRUE(seen.images[0].rejection);
  EXPECT_THAT(seen.images[0].rejection->message,
              StartsWith("is 700 x 600 px, the camera's images are 800 x 600"));
  EXPECT_TRUE(seen.images[1].is_image_kept());
}

TEST_F(BoardIntakeOfFolder, ThrowsIfNoImageIsReadable) {
  folder.file("a.png", "no image");
  EXPECT_THAT(rejection_message([&] { observe_all(); }),
              AllOf(HasSubstr("none of its 1 images can be used; the first, a.png: "),
                    HasSubstr("cannot be read as an image")));
}

TEST_F(BoardIntakeOfFolder, FailureNamesBoardFileIfTagsHaveOtherIds) {
  write("a.png", good);
  write("b.png", other);
  board.first_id += 100;
  const Observations seen = observe_all();
  ASSERT_TRUE(seen.failure);
  EXPECT_TRUE(seen.failure->is_wrong_file);
  EXPECT_EQ(seen.failure->file, "board.yaml");
  EXPECT_THAT(seen.failure->message, HasSubstr("with other ids than those of the board"));
}

TEST_F(BoardIntakeOfFolder, ReturnsCachedDetectionButAppliesCurrentLimits) {
  const fs::path file = write("a.png", good);
  options.corner_cache = folder / "cache";
  const BoardIntake intake(board, options);
  const Observation detected = intake.detect_board(SourceImage(file));
  ASSERT_FALSE(fs::is_empty(options.corner_cache));
  const Observation cached = intake.detect_board(SourceImage(file));
  ASSERT_TRUE(detected.board && cached.board);
  ASSERT_TRUE(detected.blur_px);
  ASSERT_FALSE(detected.board->detection.tags.empty());
  EXPECT_EQ(detected.blur_px, cached.blur_px);
  EXPECT_EQ(detected.size_px, cached.size_px);
  EXPECT_EQ(detected.board->detection.tags.size(), cached.board->detection.tags.size());
  // The stored figures count, not the image.
  CornerCache(options.corner_cache, board)
      .store_cached_view(SourceImage(file), {*detected.board, 1.25, 0.9, 0.1});
  EXPECT_EQ(intake.detect_board(SourceImage(file)).blur_px, 1.25);
  // Limits are no part of the cache.
  options.max_blur_fraction = 0.0001;
  EXPECT_EQ(rejection_reason(BoardIntake(board, options).detect_board(SourceImage(file))),
            RejectionReason::blurred);
}

}  // namespace
}  // namespace vlp
