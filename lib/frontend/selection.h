// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "frontend/observation.h"

namespace vlp {

/// Use of a set of images, which determines the reasons for a rejection.
enum class ImageUse {
  boards,  // calibration of the lens: rejects repeated images and views
  turn,    // rotation in place: rejects repeated images and views, and fewer than two lamps
  places,  // captures at known positions: rejects repeated images, and fewer than two lamps
  fixes    // captures to locate: rejects no image for its content
};

/// Filter for images that repeat an image in use. Two images show the same view if they share at
/// least 70 % of their corners (or lamps). In addition, their RMS distance is at most
/// `same_view_fraction` of the image width. They are copies if corners (or lamps) are identical.
class Selection {
 public:
  Selection(ImageUse use, const FrontendOptions& options)
      : use_(use), same_view_fraction_(options.same_view_fraction) {}

  /// Rejects the image if it repeats one that was added or kept before. Does not change images that
  /// are already rejected or have no corners or lamps.
  void add(Observation& image);

  /// Adds an image that is used, without a check.
  void keep(const Observation& image);

 private:
  struct Kept {
    std::string name;
    std::vector<PointDetection> points;
  };
  ImageUse use_;
  double same_view_fraction_;
  std::vector<Kept> kept_;
};

/// Applies a Selection to images in their order.
void reject_repeated(std::vector<Observation>& images, ImageUse use,
                     const FrontendOptions& options);

/// Returns the minimum number of lamps that an image needs.
int min_lamps(ImageUse use);

}  // namespace vlp
