// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Measures the evaluation of a million fixes: the program, the reading of both tables, and the
/// statistics with their intervals.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "captures/number_text.h"
#include "evaluation/evaluation.h"
#include "support/random.h"

namespace vlp {
namespace {

struct Tables {
  std::filesystem::path fixes = "benchmark_fixes.csv", truth = "benchmark_truth.csv";
  ~Tables() {
    std::filesystem::remove(fixes);
    std::filesystem::remove(truth);
  }
};

/// Each capture at its own position, or twelve at each.
Tables written(std::size_t count, std::size_t at_each) {
  Tables tables;
  Random random(1);
  std::vector<FixRow> fixes;
  fixes.reserve(count);
  std::ofstream truth(tables.truth);
  truth << "image,x_m,y_m,z_m,yaw_rad\n";
  Eigen::Vector3d place_m;
  for (std::size_t i = 0; i < count; ++i) {
    if (i % at_each == 0) place_m = {random.uniform(-9, 9), random.uniform(-9, 9), 0};
    const std::string image = std::to_string(i) + ".png";
    const Eigen::Vector3d error_m(1e-3 * random.normal(), 1e-3 * random.normal(), 1e-3);
    const Eigen::Vector4d sd = Eigen::Vector4d::Constant(1e-3);
    fixes.push_back({image, "ok", FixRow::Fix{{place_m + error_m, 0.1}, sd, 0.1}, 4});
    truth << image << ',' << format_fixed_decimals(place_m.x(), 9) << ','
          << format_fixed_decimals(place_m.y(), 9) << ",0.0,0.1\n";
  }
  write_fixes(tables.fixes, fixes);
  return tables;
}

void arguments(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"fixes", "at_each"})->Unit(benchmark::kMillisecond)->UseRealTime();
  benchmark->Args({1000, 12})->Args({1000000, 1})->Args({1000000, 12})->Iterations(1);
}

void program(benchmark::State& state) {
  const Tables tables =
      written(static_cast<std::size_t>(state.range(0)), static_cast<std::size_t>(state.range(1)));
  const std::string command = VLP_PROGRAMS_DIR "/vlp-evaluate " + tables.fixes.string() +
                              " --truth " + tables.truth.string() + " > /dev/null";
  for (auto _ : state) {
    if (std::system(command.c_str()) != 0) state.SkipWithError("vlp-evaluate failed");
  }
}
BENCHMARK(program)->Apply(arguments);

void read_tables(benchmark::State& state) {
  const Tables tables =
      written(static_cast<std::size_t>(state.range(0)), static_cast<std::size_t>(state.range(1)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(read_fixes(tables.fixes));
    benchmark::DoNotOptimize(read_truth_table(tables.truth));
  }
}
BENCHMARK(read_tables)->Apply(arguments);

void evaluate_fixes(benchmark::State& state) {
  const Tables tables =
      written(static_cast<std::size_t>(state.range(0)), static_cast<std::size_t>(state.range(1)));
  EvaluationInput input;
  input.fixes = {tables.fixes, read_fixes(tables.fixes)};
  input.truth = FileRows<TruthRow>{tables.truth, read_truth_table(tables.truth)};
  input.threads = 2;
  for (auto _ : state) benchmark::DoNotOptimize(evaluate_fixes(input));
}
BENCHMARK(evaluate_fixes)->Apply(arguments);

}  // namespace
}  // namespace vlp
