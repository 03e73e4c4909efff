// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>

#include "lamps/image/image_view.h"
#include "rig/calibration.h"

namespace vlp {

/// What images say of the read-out.
struct ReadoutEvidence {
  /// Striped lights seen with a read-out along rows, and along columns, each counted by how clear
  /// and full its stripes and how round it is, from 0 to 1.
  double rows = 0, columns = 0;

  /// The one with more, three times as much as the other and of two lights or more at least, in
  /// the clear; nothing otherwise.
  std::optional<Readout> readout() const;
};

/// Adds what an image shows: with the right read-out a lamp is a disc with stripes across, with the
/// other one it falls to pieces or has none.
void add_evidence(const ImageView& image, ReadoutEvidence& evidence);

/// The read-out from the first images that show it, at most eight with lights. `image` gives an
/// image by number, which is used until the next call of it, or an empty one if it cannot be used.
std::optional<Readout> find_readout(std::size_t images,
                                    const std::function<ImageView(std::size_t)>& image);

}  // namespace vlp
