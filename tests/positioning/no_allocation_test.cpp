// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// A Positioner neither allocates nor throws, and several threads may share it.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <new>
#include <thread>

#include "positioning/positioner.h"
#include "positioning/vlp.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace {
std::atomic<long> allocations{0};
}

// Counts every allocation of this program. Inlined, GCC would report free() as a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (size + step - 1) / step * step)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace vlp {
namespace {

SyntheticRig tilted_rig() {
  SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0.1, 0, 0}, 2}, {}};
  for (std::size_t i = 0; i < 4; ++i)
    rig.map.lamps[i].position_m.z() += 0.1 * static_cast<double>(i);
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.03, 1);
  rig.calibration.camera.row_time_s = 55e-6;
  rig.calibration.camera.readout = Readout::rows;
  return rig;
}

static_assert(noexcept(std::declval<const Positioner&>().compute_position_fix({}, {})));

TEST(Positioner, PositionFixAllocatesNoMemory) {
  const SyntheticRig rig = tilted_rig();
  PositionerOptions options;
  options.mount = CameraMount{{0.1, 0.2, 0.3}, 0.4};
  const Positioner positioner(rig.map, rig.calibration, options);
  const auto good = seen_from(rig);
  ASSERT_EQ(good.size(), 8U);
  auto swapped = good, bad = good;
  std::swap(swapped[0].lamp, swapped[6].lamp);
  for (Detection& detection : bad) detection.lamp = 1 + detection.lamp % 8;
  const Sensors sensors{Inclination{0.01, 0.02}, 0.001, HeightAndYaw{0, 0}};
  // All combinations of estimated states of a body, from one frame and from two.
  std::array<Sensors, 8> bodies;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].motion = KnownMotion::make_motion_prior_from_limits(i & 1 ? 1 : 0, i & 2 ? 1 : 0);
    bodies[i].inclination_sigma_rad = i & 4 ? 1.6 : 0;
    bodies[i].height = KnownHeight{0, 1};
  }
  for (const auto& detections : {good, swapped, bad, {}}) {
    const std::array earlier{EarlierFrame{good, 0.05}};
    const long before = allocations;
    for (std::size_t count = 0; count <= detections.size(); ++count) {
      (void)positioner.compute_position_fix({detections.data(), count}, sensors);
      for (const Sensors& body : bodies) {
        (void)positioner.compute_position_fix({detections.data(), count}, body);
        (void)positioner.compute_position_fix({detections.data(), count}, body, earlier);
      }
    }
    EXPECT_EQ(allocations, before);
  }
  const long before = allocations;
  ::operator delete(::operator new(1));
  EXPECT_EQ(allocations, before + 1) << "the counter does not count";
}

TEST(Positioner, PositionFixAllocatesNoMemoryWithSplinedLens) {
  SyntheticRig rig = tilted_rig();
  rig.calibration.camera = splined_camera();
  const Positioner positioner(rig.map, rig.calibration);
  const auto detections = seen_from(rig);
  const long before = allocations;
  EXPECT_TRUE(positioner.compute_position_fix(detections).has_succeeded());
  EXPECT_EQ(allocations, before);
}

TEST(CFunctionVlpLocate, AllocatesNoMemory) {
  const SyntheticRig rig = tilted_rig();
  const TemporaryFolder folder;
  const std::string lamps = folder / "lamps.yaml", calibration = folder / "calibration.yaml";
  write_lamp_map(lamps, rig.map);
  write_calibration(calibration, rig.calibration);
  vlp_positioner* positioner = nullptr;
  ASSERT_EQ(vlp_open(lamps.c_str(), calibration.c_str(), nullptr, &positioner), VLP_OK);
  std::vector<vlp_detection> seen;
  for (const Detection& detection : seen_from(rig)) {
    seen.push_back({detection.lamp, detection.pixel.x(), detection.pixel.y(), 0.1});
  }
  ASSERT_EQ(seen.size(), 8U);
  vlp_sensors sensors = {};
  sensors.inclination_sigma_rad = 1.6;
  vlp_fix fix;
  const long before = allocations;
  EXPECT_EQ(vlp_locate(positioner, seen.data(), seen.size(), nullptr, &fix), VLP_OK);
  EXPECT_EQ(vlp_locate(positioner, seen.data(), seen.size(), &sensors, &fix), VLP_OK);
  EXPECT_EQ(vlp_locate(positioner, seen.data(), 1, &sensors, &fix), VLP_TOO_FEW_LAMPS);
  EXPECT_EQ(allocations, before);
  vlp_close(positioner);
}

TEST(Positioner, ComputesEqualFixesInConcurrentThreads) {
  const SyntheticRig rig = tilted_rig();
  const Positioner positioner(rig.map, rig.calibration);
  const auto detections = seen_from(rig);
  const Fix expected = positioner.compute_position_fix(detections);
  ASSERT_TRUE(expected.has_succeeded());
  std::atomic<int> different{0};
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 8; ++thread) {
    threads.emplace_back([&] {
      for (int i = 0; i < 2000; ++i) {
        const Fix fix = positioner.compute_position_fix(detections);
        if (fix.state.pose.position_m != expected.state.pose.position_m ||
            fix.pose_covariance() != expected.pose_covariance()) {
          ++different;
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(different, 0);
}

}  // namespace
}  // namespace vlp
