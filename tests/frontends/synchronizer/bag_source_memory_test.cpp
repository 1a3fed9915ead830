#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "frontends/synchronizer/bag_source.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

/// Resident memory of this process, in MB.
double resident_mb() {
  std::ifstream stream("/proc/self/statm");
  double pages = 0.0;
  double resident = 0.0;
  stream >> pages >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

TEST(BagSourceMemory, DoesNotGrowWithTheLog) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  testing::SyntheticLog log;
  log.scans = 400;
  log.points_per_scan = 16384;  // 0.5 MB per scan, 210 MB in total
  log.write(path);
  WarningLog warnings;
  BagSource source(path, log.platform(), warnings);
  Measurement measurement;
  int scans = 0;
  double after_warm_up = 0.0;
  double largest = 0.0;
  while (source.next(measurement)) {
    if (!std::holds_alternative<LidarScan>(measurement)) continue;
    if (++scans == 20) after_warm_up = resident_mb();
    if (scans > 20) largest = std::max(largest, resident_mb());
  }
  EXPECT_EQ(scans, 400);
  EXPECT_LT(largest - after_warm_up, 10.0);
}

}  // namespace
}  // namespace lodestone
