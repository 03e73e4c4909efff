// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/pixel_runs.h"

#include <algorithm>
#include <numeric>

namespace vlp {
namespace {

/// Returns true if a pixel of a tile's row is lit. The loop has no branches, so that it is compiled
/// to vector instructions.
template <typename Level>
bool has_pixel_above(const Level* pixels, int count, Level threshold) {
  Level brightest = 0;
  if (count == kTile_px) {
    for (int i = 0; i < kTile_px; ++i) brightest = std::max(brightest, pixels[i]);
  } else {
    for (int i = 0; i < count; ++i) brightest = std::max(brightest, pixels[i]);
  }
  return brightest > threshold;
}

template <typename Level>
void add_runs_of_row(const Level* pixels, int columns, int row, Level threshold,
                     const std::vector<int>& tiles, std::vector<PixelRun>& runs) {
  constexpr int max_gap = 2, min_width = 3;
  PixelRun run{row, 0, -1};  // empty
  const auto finish = [&] {
    if (run.pixel_run_width_px() >= min_width) runs.push_back(run);
    run.end = -1;
  };
  for (const int tile : tiles) {
    const int begin = tile * kTile_px, end = std::min(begin + kTile_px, columns);
    if (!has_pixel_above(pixels + begin, end - begin, threshold)) continue;
    for (int column = begin; column < end; ++column) {
      if (pixels[column] <= threshold) continue;
      if (run.end >= 0 && column - run.end > max_gap) finish();
      if (run.end < 0) run.begin = column;
      run.end = column + 1;
    }
  }
  if (run.end >= 0) finish();
}

template <typename Level>
std::vector<PixelRun> list_runs_above(const ImageView& image, Level threshold,
                                      const TileMask& lit) {
  std::vector<PixelRun> runs;
  std::vector<int> tiles;
  for (int top = 0; top < image.height; top += kTile_px) {
    tiles.clear();
    for (int tile = 0; tile * kTile_px < image.width; ++tile) {
      if (lit.empty() || lit.tile_row(top / kTile_px)[tile] != 0) tiles.push_back(tile);
    }
    if (tiles.empty()) continue;
    for (int row = top; row < std::min(top + kTile_px, image.height); ++row) {
      add_runs_of_row(image.row_pixels<Level>(row), image.width, row, threshold, tiles, runs);
    }
  }
  return runs;
}

/// Blob under construction, with the columns of its last two lit rows.
struct Growing {
  Growing(const PixelRun& run) : blob{{run}}, last_row(run.row), last(run), before(run) {}

  bool touches_run(const PixelRun& run) const {
    return run.begin < std::max(last.end, before.end) &&
           run.end > std::min(last.begin, before.begin);
  }
  void add(const PixelRun& run) {
    blob.runs.push_back(run);
    if (run.row != last_row) before = last, last = run;
    last = {run.row, std::min(last.begin, run.begin), std::max(last.end, run.end)};
    last_row = run.row;
  }
  void merge_blob(Growing& other) {
    blob.runs.insert(blob.runs.end(), other.blob.runs.begin(), other.blob.runs.end());
    last.begin = std::min(last.begin, other.last.begin);
    last.end = std::max(last.end, other.last.end);
    other.alive = false;
  }

  Blob blob;
  int last_row;
  PixelRun last, before;
  bool alive = true;
};

}  // namespace

PixelBox Blob::blob_bounding_box() const {
  int begin = runs[0].begin, end = runs[0].end;
  for (const PixelRun& run : runs) {
    begin = std::min(begin, run.begin);
    end = std::max(end, run.end);
  }
  return {begin, first_blob_row(), end - begin, last_blob_row() + 1 - first_blob_row()};
}

double mean_level(const ImageView& image, const PixelRun& run) {
  return visit_levels(image, [&](auto level) {
    const auto* row = image.row_pixels<decltype(level)>(run.row);
    return std::accumulate(row + run.begin, row + run.end, 0.0) / run.pixel_run_width_px();
  });
}

std::vector<PixelRun> list_pixel_runs(const ImageView& image, double threshold,
                                      const TileMask& lit) {
  if (threshold >= image.get_max_gray_level()) return {};
  return visit_levels(image, [&](auto level) {
    return list_runs_above(image, static_cast<decltype(level)>(threshold), lit);
  });
}

std::vector<Blob> group_into_blobs(const std::vector<PixelRun>& runs, int max_dark_rows) {
  std::vector<Growing> growing;
  std::vector<Blob> done;
  const auto retire = [&](int row) {
    for (std::size_t i = 0; i < growing.size();) {
      if (growing[i].alive && row - growing[i].last_row <= max_dark_rows + 1) {
        ++i;
        continue;
      }
      if (growing[i].alive) done.push_back(std::move(growing[i].blob));
      growing[i] = std::move(growing.back());
      growing.pop_back();
    }
  };
  for (const PixelRun& run : runs) {
    retire(run.row);
    Growing* home = nullptr;
    for (Growing& each : growing) {
      if (!each.alive || !each.touches_run(run)) continue;
      if (home == nullptr) {
        home = &each;
      } else {
        home->merge_blob(each);  // the run joins two blobs
      }
    }
    if (home == nullptr) {
      growing.emplace_back(run);
    } else {
      home->add(run);
    }
  }
  for (Growing& each : growing) {
    if (each.alive) done.push_back(std::move(each.blob));
  }
  const auto by_place = [](const PixelRun& a, const PixelRun& b) {
    return a.row != b.row ? a.row < b.row : a.begin < b.begin;
  };
  for (Blob& blob : done) std::sort(blob.runs.begin(), blob.runs.end(), by_place);
  std::sort(done.begin(), done.end(),
            [&](const Blob& a, const Blob& b) { return by_place(a.runs[0], b.runs[0]); });
  return done;
}

}  // namespace vlp
