// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/readout.h"

#include "lamps/light_detector.h"

namespace vlp {
namespace {

double clear_stripes(const ImageView& image, Readout readout) {
  const LightDetector detector({}, {readout, {}, {}});
  double sum = 0;
  for (const Light& light : detector.detect(image)) {
    if (!flickers(light)) continue;
    sum += light.stripes.clarity * light.stripes.contrast * light.roundness;
  }
  return sum;
}

}  // namespace

std::optional<Readout> ReadoutEvidence::readout() const {
  constexpr double times = 3, least = 1;
  if (rows >= least && rows >= times * columns) return Readout::rows;
  if (columns >= least && columns >= times * rows) return Readout::columns;
  return std::nullopt;
}

void add_evidence(const ImageView& image, ReadoutEvidence& evidence) {
  evidence.rows += clear_stripes(image, Readout::rows);
  evidence.columns += clear_stripes(image, Readout::columns);
}

std::optional<Readout> find_readout(std::size_t images,
                                    const std::function<ImageView(std::size_t)>& image) {
  constexpr double enough = 6;
  constexpr int most_used = 8;
  ReadoutEvidence evidence;
  int used = 0;
  for (std::size_t i = 0; i < images && used < most_used; ++i) {
    const ImageView frame = image(i);
    if (frame.empty()) continue;
    const double before = evidence.rows + evidence.columns;
    add_evidence(frame, evidence);
    if (evidence.rows + evidence.columns > before) ++used;
    if (evidence.rows + evidence.columns >= enough && evidence.readout()) break;
  }
  return evidence.readout();
}

}  // namespace vlp
