// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/observation.h"

#include <gtest/gtest.h>

#include <string>

namespace vlp {
namespace {

/// Returns an image of 800 x 600 px that shows lamps 1, 2, ... at these pixels.
Observation image_of_lamps(const std::string& name, const std::vector<Eigen::Vector2d>& pixels) {
  Observation image{name};
  image.size_px = {800, 600};
  int lamp = 0;
  for (const Eigen::Vector2d& pixel : pixels) {
    Light light{};
    light.kind = LightKind::lamp;
    light.lamp = ++lamp;
    light.pixel = pixel;
    image.lights.push_back(light);
  }
  return image;
}

/// Returns the reasons of the images, after a selection; std::nullopt for those that are kept.
std::vector<std::optional<RejectionReason>> select(std::vector<Observation> images, ImageUse use) {
  reject_repeated_images(images, use, {});
  std::vector<std::optional<RejectionReason>> reasons;
  for (const Observation& image : images) {
    reasons.push_back(image.is_image_kept() ? std::nullopt
                                            : std::optional(image.rejection->reason));
  }
  return reasons;
}

using Reasons = std::vector<std::optional<RejectionReason>>;
const std::vector<Eigen::Vector2d> kPixels{{100, 100}, {400, 120}, {700, 90}, {420, 500}};

TEST(SelectImages, RejectsCopiesAndSameViewsDependingOnImageUse) {
  auto near = kPixels, far = kPixels;
  for (Eigen::Vector2d& pixel : near) pixel.x() += 7.9;  // 1 % of the width is 8 px
  for (Eigen::Vector2d& pixel : far) pixel.x() += 8.1;
  const std::vector images{image_of_lamps("a", kPixels), image_of_lamps("b", kPixels),
                           image_of_lamps("c", near), image_of_lamps("d", far)};
  EXPECT_EQ(select(images, ImageUse::rotation),
            (Reasons{{}, RejectionReason::same_image, RejectionReason::same_view, {}}));
  EXPECT_EQ(select(images, ImageUse::known_positions),
            (Reasons{{}, RejectionReason::same_image, {}, {}}));
  EXPECT_EQ(select(images, ImageUse::fixes), (Reasons{{}, {}, {}, {}}));
}

TEST(SelectImages, KeepsViewThatSharesOnlyHalfOfLamps) {
  auto fewer = kPixels;
  fewer.resize(2);  // half of the lamps
  EXPECT_EQ(select({image_of_lamps("a", kPixels), image_of_lamps("b", fewer)}, ImageUse::rotation),
            (Reasons{{}, {}}));
  fewer = kPixels;
  fewer.resize(3);  // three quarters
  EXPECT_EQ(select({image_of_lamps("a", kPixels), image_of_lamps("b", fewer)}, ImageUse::rotation),
            (Reasons{{}, RejectionReason::same_view}));
}

TEST(SelectImages, KeepsCopyOfRejectedImage) {
  auto images = std::vector{image_of_lamps("a", kPixels), image_of_lamps("b", kPixels)};
  images[0].reject(RejectionReason::blurred, "blurred");
  EXPECT_EQ(select(images, ImageUse::rotation), (Reasons{RejectionReason::blurred, {}}));
}

TEST(SelectImages, KeepsImagesWithoutLamps) {
  EXPECT_EQ(select({image_of_lamps("a", {}), image_of_lamps("b", {})}, ImageUse::rotation),
            (Reasons{{}, {}}));
}

TEST(SelectImages, RejectsCopyOfImageAddedByAddKeptImage) {
  std::vector images{image_of_lamps("a", kPixels), image_of_lamps("b", kPixels)};
  Selection selection(ImageUse::rotation, {});
  selection.add_kept_image(images[0]);
  selection.add_or_reject(images[1]);
  ASSERT_FALSE(images[1].is_image_kept());
  EXPECT_EQ(images[1].rejection->message, "is the same image as a");
}

}  // namespace
}  // namespace vlp
