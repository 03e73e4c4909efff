// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "captures/parallel_for.h"
#include "frontend/video.h"
#include "rig/input_error.h"

namespace vlp {

ImageSource::ImageSource(std::vector<std::filesystem::path> files, const FrontendOptions& options,
                         const std::optional<std::array<int, 2>>& imager_px)
    : files_(std::move(files)), every_(options.every) {
  for (const auto& file : files_) {
    if (!is_video_file_name(file)) {
      ++expected_;
      continue;
    }
    Video video(file.string());
    const auto [width, height] = video.frame_size_px();
    check_megapixels(file, width, height, options.max_mpx);
    check_image_size(file, {width, height}, imager_px);
    // [FILE-8] `no frame that can be decoded`
    if (!video.read_next_frame()) throw InputError(file, "contains no frame that can be decoded");
    const auto every = static_cast<std::size_t>(every_);
    expected_ += (std::max<std::size_t>(video.reported_frame_count(), 1) + every - 1) / every;
  }
}

ImageSource::~ImageSource() = default;

std::size_t ImageSource::expected_image_count() const { return expected_; }

std::optional<SourceImage> ImageSource::read_video_frame() {
  const auto& file = files_[file_];
  if (!video_) {
    video_ = std::make_unique<Video>(file.string());
  } else {
    for (int i = 1; i < every_; ++i) video_->skip_video_frame();
  }
  auto frame = video_->read_next_frame();
  if (!frame) {
    const std::string missing = video_->describe_missing_frames();
    if (!missing.empty()) warnings_.push_back(file.string() + ": " + missing);
    video_.reset();
    return {};
  }
  SourceImage image(make_frame_name(file.string(), frame->number));
  image.frame = std::move(frame->image);
  image.time_s = frame->time_s;
  return image;
}

std::optional<SourceImage> ImageSource::read_next_image() {
  const std::lock_guard lock(mutex_);
  for (; file_ < files_.size(); ++file_) {
    std::optional<SourceImage> image;
    if (is_video_file_name(files_[file_])) {
      image = read_video_frame();
      if (!image) continue;
    } else {
      image.emplace(files_[file_++]);
    }
    image->index = num_returned_++;
    return image;
  }
  return {};
}

void process_images(std::size_t count, int threads, const std::function<void(std::size_t)>& process,
                    const std::function<void(std::size_t done)>& progress) {
  cv::setNumThreads(1);
  std::mutex counting;
  std::size_t done = 0;
  parallel_for(count, threads, [&](std::size_t i) {
    process(i);
    if (!progress) return;
    const std::lock_guard lock(counting);
    progress(++done);
  });
}

void for_each_image(ImageSource& source, int threads,
                    const std::function<void(const SourceImage&)>& task) {
  const auto workers = static_cast<std::size_t>(threads);
  std::atomic<bool> failed = false;
  process_images(workers, threads, [&](std::size_t) {
    try {
      while (!failed) {
        const auto image = source.read_next_image();
        if (!image) return;
        task(*image);
      }
    } catch (...) {
      failed = true;
      throw;
    }
  });
}

std::string explain_image_size(const std::array<int, 2>& size_px,
                               const std::array<int, 2>& imager_px) {
  return fmt::format("is {} x {} px, the camera's images are {} x {} px", size_px[0], size_px[1],
                     imager_px[0], imager_px[1]);
}

void check_image_size(const std::filesystem::path& file, const std::array<int, 2>& size_px,
                      const std::optional<std::array<int, 2>>& imager_px) {
  if (!imager_px || size_px == *imager_px) return;
  throw InputError(file, explain_image_size(size_px, *imager_px));
}

}  // namespace vlp
