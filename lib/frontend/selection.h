// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "frontend/observation.h"

namespace vlp {

/// Use of a set of images, which determines the reasons for a rejection.
enum class ImageUse {
  boards,  // calibration of the lens: repeated images and views are rejected
  turn,    // captures of a turn on the spot: the same, and fewer than two lamps
  places,  // captures at known places: repeated images, and fewer than two lamps
  fixes    // captures to locate: none is rejected for what it shows
};

/// Rejects images that repeat one that is used. Two images show the same view if they share 70 % of
/// their corners (or lamps) and these are `same_view_fraction` of the image's width apart or less,
/// rms. They are copies if corners (or lamps) agree to the last digit.
class Selection {
 public:
  Selection(ImageUse use, const FrontendOptions& options)
      : use_(use), same_view_fraction_(options.same_view_fraction) {}

  /// Rejects the image if it repeats one that was added or kept before. Images that are rejected
  /// already, or that show nothing, are left as they are.
  void add(Observation& image);

  /// Adds an image that is used, without a check.
  void keep(const Observation& image);

 private:
  struct Kept {
    std::string name;
    std::vector<SeenPoint> points;
  };
  ImageUse use_;
  double same_view_fraction_;
  std::vector<Kept> kept_;
};

/// Applies a Selection to images in their order.
void reject_repeated(std::vector<Observation>& images, ImageUse use,
                     const FrontendOptions& options);

/// Number of lamps below which an image is of no use.
int min_lamps(ImageUse use);

}  // namespace vlp
