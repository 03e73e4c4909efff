// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/seeded_random.h"

#include <array>
#include <random>
#include <vector>

namespace vlp {

cv::RNG make_random(std::uint64_t seed, std::string_view name, std::size_t index) {
  std::vector<std::uint32_t> words{std::uint32_t(seed), std::uint32_t(seed >> 32),
                                   std::uint32_t(index), std::uint32_t(index >> 32)};
  words.insert(words.end(), name.begin(), name.end());
  std::seed_seq sequence(words.begin(), words.end());
  std::array<std::uint32_t, 2> state{};
  sequence.generate(state.begin(), state.end());
  return cv::RNG(state[0] | std::uint64_t(state[1]) << 32);
}

std::uint64_t draw_seed_from(cv::RNG& random) {
  const std::uint64_t high = random.next();
  return high << 32 | random.next();
}

}  // namespace vlp
