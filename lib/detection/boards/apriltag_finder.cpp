// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <apriltag/apriltag.h>

#include <map>
#include <mutex>
#include <new>
#include <string>
#include <utility>

#include "detection/boards/tag_finder.h"
#include "detection/boards/tag_pattern.h"

namespace vlp {
namespace {

/// Coordinate of the center of the top-left pixel in libapriltag.
constexpr double kPixelCenter = 0.5;
/// Number of pixels from which an image is searched at half the resolution. The corners are the
/// same, because they are fitted at full resolution.
constexpr int kLargePixels = 1'000'000;

using DetectorPointer = std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)>;

/// libapriltag's decoding table of a tag family, which corrects bit errors. It is expensive to
/// create, read-only, and independent of the border width.
class DecodingTable {
 public:
  explicit DecodingTable(const std::string& name) : family_(make_tag_family(name)) {
    constexpr uint32_t large = 3000;  // gigabytes with two bits
    apriltag_detector_add_family_bits(maker_.get(), family_.get(), family_->ncodes > large ? 1 : 2);
    if (family_->impl == nullptr) throw std::bad_alloc();
  }
  void* decoding_table() const { return family_->impl; }

 private:
  TagFamily family_;  // outlives the detector
  DetectorPointer maker_{apriltag_detector_create(), apriltag_detector_destroy};
};

/// Returns the decoding table of a family. A process creates it once and shares it with the
/// children that it forks afterwards.
void* get_decoding_table(const std::string& family) {
  static std::mutex mutex;
  static std::map<std::string, DecodingTable> tables;
  const std::lock_guard lock(mutex);
  return tables.try_emplace(family, family).first->second.decoding_table();
}

struct Detector {
  explicit Detector(const Board& board) : family(make_tag_family(board.family)) {
    for (int extra = 1; extra < board.border_bits; ++extra) widen_tag_border();
    family->impl = get_decoding_table(board.family);
    apriltag_detector_add_family(detector.get(), family.get());
    detector->nthreads = 1;
    detector->refine_edges = true;
    detector->quad_sigma = 0;  // it would write into the image
  }
  ~Detector() { family->impl = nullptr; }  // not this detector's to free
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;
  void widen_tag_border() const {
    family->width_at_border += 2;
    family->total_width += 2;
    for (uint32_t bit = 0; bit < family->nbits; ++bit) {
      ++family->bit_x[bit];
      ++family->bit_y[bit];
    }
  }

  TagFamily family;  // outlives the detector
  DetectorPointer detector{apriltag_detector_create(), apriltag_detector_destroy};
};

class ApriltagFinder : public TagFinder {
 public:
  explicit ApriltagFinder(Board board) : board_(std::move(board)) {
    return_detector(acquire_detector());
  }

  std::vector<TagDetection> detect_tags(const cv::Mat1b& image) const override {
    std::unique_ptr<Detector> detector = acquire_detector();
    detector->detector->quad_decimate = image.cols * image.rows >= kLargePixels ? 2 : 1;
    // The detector does not write to the image, but its interface lacks const.
    image_u8_t view{image.cols, image.rows, static_cast<int>(image.step), image.data};
    const std::unique_ptr<zarray_t, void (*)(zarray_t*)> found(
        apriltag_detector_detect(detector->detector.get(), &view), apriltag_detections_destroy);
    std::vector<TagDetection> tags(static_cast<std::size_t>(zarray_size(found.get())));
    for (std::size_t i = 0; i < tags.size(); ++i) {
      apriltag_detection_t* detection = nullptr;
      zarray_get(found.get(), static_cast<int>(i), static_cast<void*>(&detection));
      tags[i].id = detection->id;
      for (std::size_t k = 0; k < 4; ++k) {
        tags[i].corners_px[k] = {detection->p[k][0] - kPixelCenter,
                                 detection->p[k][1] - kPixelCenter};
      }
    }
    return_detector(std::move(detector));
    return tags;
  }

 private:
  /// Returns an idle detector, or a new one. A detector serves one thread at a time and is
  /// expensive to create.
  std::unique_ptr<Detector> acquire_detector() const {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<Detector> taken = std::move(idle_.back());
        idle_.pop_back();
        return taken;
      }
    }
    return std::make_unique<Detector>(board_);
  }
  void return_detector(std::unique_ptr<Detector> detector) const {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(detector));
  }

  Board board_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Detector>> idle_;
};

}  // namespace

void load_tag_family(const std::string& name) { get_decoding_table(name); }

std::unique_ptr<TagFinder> make_apriltag_finder(const Board& board) {
  return std::make_unique<ApriltagFinder>(board);
}

}  // namespace vlp
