// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tag_families.h"

#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

#include <stdexcept>

namespace vlp {

TagFamily make_tag_family(const std::string& name) {
  if (name == "tag36h11") return {tag36h11_create(), tag36h11_destroy};
  if (name == "tag25h9") return {tag25h9_create(), tag25h9_destroy};
  if (name == "tag16h5") return {tag16h5_create(), tag16h5_destroy};
  if (name == "tagCircle21h7") return {tagCircle21h7_create(), tagCircle21h7_destroy};
  if (name == "tagCircle49h12") return {tagCircle49h12_create(), tagCircle49h12_destroy};
  if (name == "tagCustom48h12") return {tagCustom48h12_create(), tagCustom48h12_destroy};
  if (name == "tagStandard41h12") return {tagStandard41h12_create(), tagStandard41h12_destroy};
  if (name == "tagStandard52h13") return {tagStandard52h13_create(), tagStandard52h13_destroy};
  throw std::invalid_argument("there is no tag family " + name);
}

int width_in_bits(const apriltag_family_t& family, int border_bits) {
  return family.width_at_border + 2 * (border_bits - 1);
}

bool is_white(const apriltag_family_t& family, int id, uint32_t bit) {
  return ((family.codes[id] >> (family.nbits - 1 - bit)) & 1) != 0;
}

}  // namespace vlp
