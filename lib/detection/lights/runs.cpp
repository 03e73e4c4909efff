// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/lights/runs.h"

#include <algorithm>
#include <cstdint>

namespace vlp {
namespace {

constexpr int kBlock = 64;

/// Whether a pixel of a block is lit. Without a branch inside, so that it is compiled to vectors.
template <typename Level>
bool any_above(const Level* pixels, int count, Level threshold) {
  Level brightest = 0;
  if (count == kBlock) {
    for (int i = 0; i < kBlock; ++i) brightest = std::max(brightest, pixels[i]);
  } else {
    for (int i = 0; i < count; ++i) brightest = std::max(brightest, pixels[i]);
  }
  return brightest > threshold;
}

template <typename Level>
void add_runs_of_row(const Level* pixels, int columns, int row, Level threshold,
                     std::vector<Run>& runs) {
  constexpr int most_gap = 2, least_width = 3;
  Run run{row, 0, -1};  // none yet
  const auto finish = [&] {
    if (run.width() >= least_width) runs.push_back(run);
    run.end = -1;
  };
  for (int block = 0; block < columns; block += kBlock) {
    const int end = std::min(block + kBlock, columns);
    if (!any_above(pixels + block, end - block, threshold)) continue;
    for (int column = block; column < end; ++column) {
      if (pixels[column] <= threshold) continue;
      if (run.end >= 0 && column - run.end > most_gap) finish();
      if (run.end < 0) run.begin = column;
      run.end = column + 1;
    }
  }
  if (run.end >= 0) finish();
}

template <typename Level>
std::vector<Run> runs_of(const cv::Mat& image, double threshold) {
  std::vector<Run> runs;
  const auto level = static_cast<Level>(threshold);
  for (int row = 0; row < image.rows; ++row) {
    add_runs_of_row(image.ptr<Level>(row), image.cols, row, level, runs);
  }
  return runs;
}

/// A blob while it grows, and the columns of its last two lit rows.
struct Growing {
  Growing(const Run& run) : blob{{run}}, last_row(run.row), last(run), before(run) {}

  bool meets(const Run& run) const {
    return run.begin < std::max(last.end, before.end) &&
           run.end > std::min(last.begin, before.begin);
  }
  void add(const Run& run) {
    blob.runs.push_back(run);
    if (run.row != last_row) before = last, last = run;
    last = {run.row, std::min(last.begin, run.begin), std::max(last.end, run.end)};
    last_row = run.row;
  }
  void absorb(Growing& other) {
    blob.runs.insert(blob.runs.end(), other.blob.runs.begin(), other.blob.runs.end());
    last.begin = std::min(last.begin, other.last.begin);
    last.end = std::max(last.end, other.last.end);
    other.alive = false;
  }

  Blob blob;
  int last_row;
  Run last, before;
  bool alive = true;
};

}  // namespace

cv::Rect Blob::box() const {
  int begin = runs[0].begin, end = runs[0].end;
  for (const Run& run : runs) {
    begin = std::min(begin, run.begin);
    end = std::max(end, run.end);
  }
  return {begin, top(), end - begin, bottom() + 1 - top()};
}

std::vector<Run> find_runs(const cv::Mat& image, double threshold) {
  const double most = image.depth() == CV_8U ? 255 : 65535;
  if (threshold >= most) return {};
  return image.depth() == CV_8U ? runs_of<std::uint8_t>(image, threshold)
                                : runs_of<std::uint16_t>(image, threshold);
}

std::vector<Blob> group_runs(const std::vector<Run>& runs, int most_dark_rows) {
  std::vector<Growing> growing;
  std::vector<Blob> done;
  const auto retire = [&](int row) {
    for (std::size_t i = 0; i < growing.size();) {
      if (growing[i].alive && row - growing[i].last_row <= most_dark_rows + 1) {
        ++i;
        continue;
      }
      if (growing[i].alive) done.push_back(std::move(growing[i].blob));
      growing[i] = std::move(growing.back());
      growing.pop_back();
    }
  };
  for (const Run& run : runs) {
    retire(run.row);
    Growing* home = nullptr;
    for (Growing& each : growing) {
      if (!each.alive || !each.meets(run)) continue;
      if (home == nullptr) {
        home = &each;
      } else {
        home->absorb(each);  // the run joins two blobs
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
  const auto by_place = [](const Run& a, const Run& b) {
    return a.row != b.row ? a.row < b.row : a.begin < b.begin;
  };
  for (Blob& blob : done) std::sort(blob.runs.begin(), blob.runs.end(), by_place);
  std::sort(done.begin(), done.end(),
            [&](const Blob& a, const Blob& b) { return by_place(a.runs[0], b.runs[0]); });
  return done;
}

}  // namespace vlp
