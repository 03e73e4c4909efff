// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/readout.h"

#include <utility>

namespace vlp {

std::optional<Readout> ReadoutDirectionEvidence::readout_direction() const {
  constexpr double min_ratio = 3, min_evidence = 1;
  if (rows >= min_evidence && rows >= min_ratio * columns) return Readout::rows;
  if (columns >= min_evidence && columns >= min_ratio * rows) return Readout::columns;
  return std::nullopt;
}

double sum_readout_evidence(std::span<const Light> lights) {
  double sum = 0;
  for (const Light& light : lights) {
    if (!is_light_modulated(light)) continue;
    sum += light.stripes.periodicity_r2 * light.stripes.contrast * light.inlier_fraction;
  }
  return sum;
}

void add_readout_evidence(const ImageView& image, ReadoutDirectionEvidence& evidence) {
  const LightDetector by_rows({}, {Readout::rows, {}, {}});
  evidence.rows += sum_readout_evidence(by_rows.detect_lights(image));
  evidence.columns +=
      sum_readout_evidence(by_rows.copy_with_readout(Readout::columns).detect_lights(image));
}

std::optional<Readout> estimate_readout(std::size_t images,
                                        const std::function<ImageView(std::size_t)>& image) {
  constexpr double sufficient_evidence = 6;
  constexpr int max_used = 8;
  ReadoutDirectionEvidence evidence;
  int used = 0;
  for (std::size_t i = 0; i < images && used < max_used; ++i) {
    const ImageView frame = image(i);
    if (frame.empty()) continue;
    const double before = evidence.rows + evidence.columns;
    add_readout_evidence(frame, evidence);
    if (evidence.rows + evidence.columns > before) ++used;
    if (evidence.rows + evidence.columns >= sufficient_evidence && evidence.readout_direction())
      break;
  }
  return evidence.readout_direction();
}

LightsWithReadout detect_both_readouts(const LightDetector& detector, const ImageView& image) {
  const Readout default_readout = detector.readout_direction();
  const Readout other_readout = default_readout == Readout::rows ? Readout::columns : Readout::rows;
  LightsWithReadout result{default_readout, detector.detect_lights(image)};
  std::vector<Light> lights = detector.copy_with_readout(other_readout).detect_lights(image);
  const double default_evidence = sum_readout_evidence(result.lights),
               other_evidence = sum_readout_evidence(lights);
  const ReadoutDirectionEvidence evidence =
      default_readout == Readout::rows ? ReadoutDirectionEvidence{default_evidence, other_evidence}
                                       : ReadoutDirectionEvidence{other_evidence, default_evidence};
  if (evidence.readout_direction() == other_readout) result = {other_readout, std::move(lights)};
  return result;
}

}  // namespace vlp
