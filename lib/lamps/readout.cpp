// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/readout.h"

#include <utility>

namespace vlp {

std::optional<Readout> ReadoutEvidence::readout() const {
  constexpr double times = 3, least = 1;
  if (rows >= least && rows >= times * columns) return Readout::rows;
  if (columns >= least && columns >= times * rows) return Readout::columns;
  return std::nullopt;
}

double readout_evidence(std::span<const Light> lights) {
  double sum = 0;
  for (const Light& light : lights) {
    if (!flickers(light)) continue;
    sum += light.stripes.clarity * light.stripes.contrast * light.roundness;
  }
  return sum;
}

void add_evidence(const ImageView& image, ReadoutEvidence& evidence) {
  const LightDetector by_rows({}, {Readout::rows, {}, {}});
  evidence.rows += readout_evidence(by_rows.detect(image));
  evidence.columns += readout_evidence(by_rows.with_readout(Readout::columns).detect(image));
}

std::optional<Readout> find_readout(std::size_t images,
                                    const std::function<ImageView(std::size_t)>& image) {
  constexpr double enough = 6;
  constexpr int max_used = 8;
  ReadoutEvidence evidence;
  int used = 0;
  for (std::size_t i = 0; i < images && used < max_used; ++i) {
    const ImageView frame = image(i);
    if (frame.empty()) continue;
    const double before = evidence.rows + evidence.columns;
    add_evidence(frame, evidence);
    if (evidence.rows + evidence.columns > before) ++used;
    if (evidence.rows + evidence.columns >= enough && evidence.readout()) break;
  }
  return evidence.readout();
}

LightsByReadout detect_either_way(const LightDetector& detector, const ImageView& image) {
  const Readout usual = detector.readout();
  const Readout other = usual == Readout::rows ? Readout::columns : Readout::rows;
  LightsByReadout result{usual, detector.detect(image)};
  std::vector<Light> lights = detector.with_readout(other).detect(image);
  const double with_usual = readout_evidence(result.lights), with_other = readout_evidence(lights);
  const ReadoutEvidence evidence = usual == Readout::rows ? ReadoutEvidence{with_usual, with_other}
                                                          : ReadoutEvidence{with_other, with_usual};
  if (evidence.readout() == other) result = {other, std::move(lights)};
  return result;
}

}  // namespace vlp
