// Loops on all cores: every index once, on any number of threads, and exceptions are rethrown.
#include "core/parallel.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <atomic>
#include <numeric>
#include <stdexcept>
#include <vector>

namespace lodestone {
namespace {

TEST(Parallel, EveryIndexComesOnce) {
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    for (const std::size_t grain : {1, 7, 4096}) {
      std::vector<int> visits(10007, 0);
      parallel_for(
          -3, 10004, [&](int i) { ++visits[static_cast<std::size_t>(i + 3)]; }, grain);
      EXPECT_EQ(visits, std::vector<int>(10007, 1)) << threads << " threads, grain " << grain;
    }
  }
}

TEST(Parallel, EmptyRangesCallNothing) {
  std::atomic<int> calls{0};
  parallel_for(std::size_t{5}, std::size_t{5}, [&](std::size_t) { ++calls; });
  parallel_for(4, -2, [&](int) { ++calls; });
  EXPECT_EQ(calls, 0);
}

TEST(Parallel, LoopsWithinLoopsSeeWhatWasWrittenBefore) {
  std::vector<double> rows(64, 0.0);
  parallel_for(std::size_t{0}, rows.size(), [&](std::size_t row) {
    std::vector<double> cells(500);
    const double first = static_cast<double>(row);
    parallel_for(std::size_t{0}, cells.size(), [&](std::size_t i) { cells[i] = first + static_cast<double>(i); });
    rows[row] = std::accumulate(cells.begin(), cells.end(), 0.0);
  });
  for (std::size_t row = 0; row < rows.size(); ++row) EXPECT_EQ(rows[row], 500.0 * static_cast<double>(row) + 124750.0);
}

TEST(Parallel, WhatABodyThrowsComesOut) {
  std::vector<int> values(1000, 0);
  const auto work = [&](std::size_t i) {
    values[i] = 1;
    if (i == 613) throw std::invalid_argument("613");
  };
  EXPECT_THROW(parallel_for(std::size_t{0}, values.size(), work), std::invalid_argument);
  EXPECT_EQ(values[613], 1);
}

}  // namespace
}  // namespace lodestone
