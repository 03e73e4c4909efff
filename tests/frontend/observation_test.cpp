// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/observation.h"

#include <gmock/gmock.h>

#include <set>
#include <stdexcept>

#include "support/datasets.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::HasSubstr;

const std::filesystem::path kImage = kRig + "/sample/0000.png";

Observation observe(const std::function<void(const cv::Mat&)>& detect,
                    const std::optional<std::array<int, 2>>& imager_px = std::nullopt) {
  Observation image{kImage};
  read_and_detect(SourceImage(kImage), {}, imager_px, image, detect);
  return image;
}

TEST(ReadAndDetect, PassesDecodedImageToDetector) {
  cv::Size size;
  const Observation image = observe([&](const cv::Mat& pixels) { size = pixels.size(); });
  EXPECT_TRUE(image.is_image_kept());
  EXPECT_EQ(size, cv::Size(800, 600));
  EXPECT_EQ(image.size_px, (std::array{800, 600}));
}

TEST(ReadAndDetect, RejectsImageForDetectorErrorWrongSizeOrMissingFile) {
  const Observation broken =
      observe([](const cv::Mat&) { throw std::runtime_error("first\nsecond"); });
  ASSERT_FALSE(broken.is_image_kept());
  EXPECT_EQ(broken.rejection->message, "cannot be used: first second");
  const Observation other = observe([](const cv::Mat&) { FAIL(); }, std::array{640, 480});
  ASSERT_FALSE(other.is_image_kept());
  EXPECT_EQ(other.rejection->reason, RejectionReason::wrong_size);
  EXPECT_EQ(other.rejection->message, "is 800 x 600 px, the camera's images are 640 x 480 px");
  Observation missing{"none.png"};
  read_and_detect(SourceImage("none.png"), {}, {}, missing, [](const cv::Mat&) { FAIL(); });
  ASSERT_FALSE(missing.is_image_kept());
  EXPECT_EQ(missing.rejection->reason, RejectionReason::unreadable);
  EXPECT_EQ(missing.rejection->message, "cannot be opened: No such file or directory");
}

TEST(ReadAndDetect, RejectsImageAboveMaxMegapixelsWithoutCallingDetector) {
  FrontendOptions options;
  options.max_mpx = 0.1;
  Observation image{kImage};
  read_and_detect(SourceImage(kImage), options, {}, image, [](const cv::Mat&) { FAIL(); });
  ASSERT_FALSE(image.is_image_kept());
  EXPECT_EQ(image.rejection->reason, RejectionReason::unreadable);
  EXPECT_THAT(image.rejection->message, HasSubstr("more than the 0.1 million"));
}

std::vector<Observation> rejected(const std::vector<RejectionReason>& reasons) {
  std::vector<Observation> images(1, Observation{"good.png"});
  for (const RejectionReason reason : reasons) {
    Observation image{"bad.png"};
    image.reject(reason, "why");
    images.push_back(image);
  }
  return images;
}

TEST(SummarizeRejectedImages, CountsReasonsAndNamesRemedyOfMajority) {
  using enum RejectionReason;
  EXPECT_EQ(summarize_rejected_images(rejected({})), "");
  EXPECT_EQ(summarize_rejected_images(rejected({blurred, too_dark, too_dark})),
            "2 too dark, 1 blurred: more exposure, gain or light");
  EXPECT_EQ(summarize_rejected_images(rejected({blurred, overexposed})),
            "1 overexposed, 1 blurred");
}

TEST(ReasonPhrase, ReturnsUniqueNonEmptyPhraseForEachReason) {
  std::set<std::string_view> names;
  int count = 0;
  for (auto reason = RejectionReason::unreadable; reason <= RejectionReason::used_elsewhere;
       reason = static_cast<RejectionReason>(static_cast<int>(reason) + 1)) {
    EXPECT_FALSE(reason_phrase(reason).empty());
    names.insert(reason_phrase(reason));
    ++count;
  }
  EXPECT_EQ(std::ssize(names), count);
}

TEST(CheckAnyReadable, ThrowsReasonOfFirstImageWhenNoneIsUsable) {
  auto images = rejected({RejectionReason::unreadable, RejectionReason::wrong_size});
  EXPECT_NO_THROW(check_any_readable("folder", images));
  images.erase(images.begin());
  EXPECT_EQ(rejection_message([&] { check_any_readable("folder", images); }),
            "folder: none of its 2 images can be used; the first, bad.png: why");
}

}  // namespace
}  // namespace vlp
