// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include "simulation/archive.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> images_in_order(const fs::path& folder) {
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path ending = entry.path().extension();
    if (ending == ".png" || ending == ".jpg") images.push_back(entry.path());
  }
  std::sort(images.begin(), images.end());
  return images;
}

/// Truncates an image to its header and a few hundred bytes.
void truncate_image(const fs::path& image) {
  constexpr std::uintmax_t kept_bytes = 600;
  if (fs::file_size(image) > kept_bytes) fs::resize_file(image, kept_bytes);
}

}  // namespace

std::string_view to_string(ArchiveFault fault) {
  switch (fault) {
    case ArchiveFault::tilted:
      return "leaning";
    case ArchiveFault::out_of_focus:
      return "out-of-focus";
    case ArchiveFault::moved_lamp:
      return "moved-lamp";
    case ArchiveFault::cut_image:
      return "cut-image";
    case ArchiveFault::none:
      break;
  }
  return "";
}

std::string_view to_string(ArchiveDamage damage) {
  switch (damage) {
    case ArchiveDamage::cut_images:
      return "cut-images";
    case ArchiveDamage::missing:
      return "missing";
    case ArchiveDamage::wrong_board:
      return "wrong-board";
    case ArchiveDamage::empty:
      return "empty";
    case ArchiveDamage::none:
      break;
  }
  return "";
}

void damage(const ArchiveSession& session, const fs::path& folder) {
  if (session.fault == ArchiveFault::cut_image) {
    const auto& sets = session.scene.sets;
    const auto lamps =
        std::find_if(sets.rbegin(), sets.rend(), [](const CaptureSet& set) { return !set.board; });
    truncate_image(images_in_order(folder / lamps->folder).front());
  }
  const fs::path target = folder / session.damaged;
  switch (session.damage) {
    case ArchiveDamage::cut_images:
      for (const fs::path& image : images_in_order(target)) truncate_image(image);
      break;
    case ArchiveDamage::missing:
      fs::remove_all(target);
      break;
    case ArchiveDamage::wrong_board: {
      Board board = session.scene.board->print;
      board.family = board.family == "tag36h11" ? "tag25h9" : "tag36h11";
      write_board(target, board);
      break;
    }
    case ArchiveDamage::empty:
      for (const auto& entry : fs::directory_iterator(target)) fs::remove_all(entry.path());
      break;
    case ArchiveDamage::none:
      break;
  }
}

}  // namespace vlp
