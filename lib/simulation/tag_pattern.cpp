// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/tag_pattern.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

#include <map>
#include <memory>
#include <stdexcept>

namespace vlp {
namespace {

struct Family {
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

const std::map<std::string, Family>& families() {
  static const std::map<std::string, Family> all{
      {"tag16h5", {tag16h5_create, tag16h5_destroy}},
      {"tag25h9", {tag25h9_create, tag25h9_destroy}},
      {"tag36h11", {tag36h11_create, tag36h11_destroy}},
      {"tagCircle21h7", {tagCircle21h7_create, tagCircle21h7_destroy}},
      {"tagCircle49h12", {tagCircle49h12_create, tagCircle49h12_destroy}},
      {"tagCustom48h12", {tagCustom48h12_create, tagCustom48h12_destroy}},
      {"tagStandard41h12", {tagStandard41h12_create, tagStandard41h12_destroy}},
      {"tagStandard52h13", {tagStandard52h13_create, tagStandard52h13_destroy}},
  };
  return all;
}

/// Converts the id to the type of libapriltag: int, since version 3.4 unsigned.
template <typename Id>
image_u8_t* render_tag(image_u8_t* (*draw)(apriltag_family_t*, Id), apriltag_family_t* family,
                       int id) {
  return draw(family, static_cast<Id>(id));
}

}  // namespace

TagPattern make_tag_pattern(const std::string& name, int id, int border_bits) {
  const Family& family = families().at(name);
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> codes(family.create(),
                                                                               family.destroy);
  if (id < 0 || static_cast<uint32_t>(id) >= codes->ncodes) {
    throw std::invalid_argument(name + " has no tag " + std::to_string(id) + ", only 0 to " +
                                std::to_string(codes->ncodes - 1));
  }
  const bool plain = !codes->reversed_border && codes->total_width == codes->width_at_border + 2;
  if (border_bits == 2 && !plain) {
    throw std::invalid_argument("tags of " + name + " have no border of two black bits");
  }
  // For plain tags libapriltag also renders the white surroundings, which are paper here.
  const int extra = border_bits - 1;
  const int trimmed = plain ? 1 : 0;
  TagPattern pattern;
  pattern.border_width = codes->width_at_border + 2 * extra;
  pattern.outside = (codes->total_width - codes->width_at_border) / 2 - trimmed;
  const int width = pattern.width();
  pattern.white.assign(pattern.index(0, width), false);
  const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> rendered(
      render_tag(apriltag_to_image, codes.get(), id), image_u8_destroy);
  for (int row = extra; row < width - extra; ++row) {
    for (int column = extra; column < width - extra; ++column) {
      const int y = row - extra + trimmed, x = column - extra + trimmed;
      pattern.white[pattern.index(column, row)] = rendered->buf[y * rendered->stride + x] > 127;
    }
  }
  return pattern;
}

}  // namespace vlp
