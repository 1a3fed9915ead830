#include "estimators/monitored.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lodestone {
namespace {

constexpr Time sample_period = 10'000'000;

/// Records the address of each bundle's cloud, and its number of readings.
class CloudWatcher final : public Estimator {
 public:
  struct Seen {
    std::vector<const LidarPoint*> clouds;
    std::vector<int> readings;
  };
  explicit CloudWatcher(Seen& seen) : seen_(seen) {}

  void process(const ScanBundle& bundle, EstimateSink& /*sink*/) override {
    int readings = 0;
    for (const MagneticArraySample& sample : bundle.magnetic) {
      for (const auto& field : sample.field_ut) readings += field.has_value() ? 1 : 0;
    }
    seen_.clouds.push_back(bundle.scan.points.data());
    seen_.readings.push_back(readings);
  }
  void finish(EstimateSink& /*sink*/) override {}

 private:
  Seen& seen_;
};

class NoSink final : public EstimateSink {
 public:
  void causal(const Estimate& /*estimate*/) override {}
  void best(const Estimate& /*estimate*/) override {}
};

/// A scan of many points with ten readings of one magnetometer, of which the fifth is a spike.
ScanBundle bundle_with_a_spike() {
  ScanBundle bundle;
  bundle.scan.end = 10 * sample_period;
  bundle.scan.points.resize(50'000);
  for (int i = 0; i < 10; ++i) {
    const Vector3 field_ut(20.0 + 0.3 * std::sin(12.9898 * i), 0.2 * std::sin(78.2 * i), -40.0 + 0.1 * i);
    bundle.magnetic.push_back({(i + 1) * sample_period, {i == 4 ? Vector3(field_ut * 100.0) : field_ut}});
  }
  return bundle;
}

TEST(Monitored, AnUnhealthyReadingDoesNotCopyTheCloud) {
  SensorSuite suite;
  suite.magnetometers.resize(1);
  CloudWatcher::Seen seen;
  WarningLog warnings;
  Monitored monitored(std::make_unique<CloudWatcher>(seen), suite, &warnings);
  NoSink sink;
  ScanBundle bundle = bundle_with_a_spike();
  const LidarPoint* cloud = bundle.scan.points.data();
  static_cast<Estimator&>(monitored).process_in_place(bundle, sink);
  ASSERT_EQ(seen.readings, std::vector<int>{9}) << "the spike is rejected";
  EXPECT_EQ(seen.clouds.front(), cloud);
  // The caller's bundle is unchanged: a report counts all readings.
  EXPECT_EQ(bundle.scan.points.data(), cloud);
  ASSERT_EQ(bundle.magnetic.size(), 10U);
  for (const MagneticArraySample& sample : bundle.magnetic) EXPECT_TRUE(sample.field_ut.front().has_value());
}

}  // namespace
}  // namespace lodestone
