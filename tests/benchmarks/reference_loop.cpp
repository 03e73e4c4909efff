// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Runs a fixed amount of work: the unit in which times.py states times, so that machines compare.
/// Half of it is arithmetic in registers, half reads memory in random order, as the programs do.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace {

constexpr int kSteps = 20'000'000;
/// 4 MiB: more than a core's own cache, less than a processor's.
constexpr std::size_t kEntries = std::size_t{1} << 19;

}  // namespace

int main() {
  std::vector<double> table(kEntries);
  for (std::size_t i = 0; i < kEntries; ++i) table[i] = 1.0 / static_cast<double>(i + 1);
  std::uint64_t state = 1;
  double sum = 0;
  for (int step = 0; step < kSteps; ++step) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    const double value = table[state >> 45U];
    sum = std::sqrt(sum * sum + value) / (1 + 0.1 * value);
  }
  std::printf("%.17g\n", sum);  // the compiler has to compute it
}
