#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>

#include "core/evaluation/alignment.h"
#include "core/evaluation/consistency.h"
#include "core/evaluation/errors.h"
#include "core/evaluation/statistics.h"

namespace lodestone {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// A winding path, 10 Hz, with a robot that rotates all the time.
Trajectory winding_path(int count) {
  Trajectory trajectory;
  for (int i = 0; i < count; ++i) {
    const double t = 0.1 * i;
    Pose pose;
    pose.position = {t, 3.0 * std::sin(0.5 * t), 0.4 * std::cos(0.3 * t)};
    pose.rotation = so3::exp({0.1 * std::sin(t), 0.05 * t, 0.3 * t});
    trajectory.push_back({from_seconds(t), pose});
  }
  return trajectory;
}

PosePairs pairs_of(const Trajectory& estimate, const Trajectory& truth) {
  return associate_nearest(estimate, truth);
}

TEST(Association, TakesTheNearestStampWithinTheWindow) {
  const Trajectory truth = winding_path(50);
  Trajectory estimate;
  for (const int i : {3, 7, 12}) estimate.push_back(truth[static_cast<std::size_t>(i)]);
  estimate[0].time += from_seconds(0.009);
  estimate[1].time += from_seconds(0.011);
  const PosePairs pairs = associate_nearest(estimate, truth);
  ASSERT_EQ(pairs.size(), 2U);
  EXPECT_EQ(pairs[0].estimate_index, 0U);
  EXPECT_EQ(pairs[0].truth.position, truth[3].pose.position);
  EXPECT_EQ(pairs[0].time, estimate[0].time);
  EXPECT_EQ(pairs[1].estimate_index, 2U);
}

TEST(Association, WalksOverTheShorterTrajectoryWhicheverItIs) {
  const Trajectory dense = winding_path(50);
  const Trajectory sparse{dense[10], dense[20]};
  const PosePairs pairs = associate_nearest(dense, sparse);
  ASSERT_EQ(pairs.size(), 2U);
  EXPECT_EQ(pairs[1].estimate_index, 20U);
}

TEST(Association, InterpolationNeedsTruthOnBothSides) {
  const Trajectory truth = winding_path(50);
  Trajectory estimate{truth[0], truth[10], truth[49]};
  estimate[0].time -= 1;
  estimate[1].time += from_seconds(0.05);
  const PosePairs pairs = associate_interpolated(estimate, truth);
  ASSERT_EQ(pairs.size(), 2U);
  const Vector3 middle = 0.5 * (truth[10].pose.position + truth[11].pose.position);
  EXPECT_LT((pairs[0].truth.position - middle).norm(), 1e-12);
  EXPECT_TRUE(associate_interpolated({{from_seconds(1.25), {}}}, {truth[0], truth[20]}).empty());
}

TEST(Association, TruthAtTimesIsThatOfThePairs) {
  const Trajectory truth{{from_seconds(1.0), {Quaternion::Identity(), {1.0, 0.0, 0.0}}},
                         {from_seconds(1.2), {Quaternion::Identity(), {3.0, 0.0, 0.0}}}};
  const Trajectory found = truth_at({from_seconds(0.9), from_seconds(1.1), from_seconds(1.3)}, truth);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].time, from_seconds(1.1));
  EXPECT_NEAR(found[0].pose.position.x(), 2.0, 1e-12);
}

TEST(Association, AGroundTruthOfOnePoseAScanIsPairedAtItsStamps) {
  Trajectory truth;
  for (int k = 0; k < 5; ++k) truth.push_back({from_seconds(0.5 * k), {Quaternion::Identity(), Vector3(k, 0.0, 0.0)}});
  const Trajectory estimate{
      {from_seconds(0.0), {}}, {from_seconds(0.502), {}}, {from_seconds(0.75), {}}, {from_seconds(2.1), {}}};
  const PosePairs pairs = associate_interpolated(estimate, truth);
  ASSERT_EQ(pairs.size(), 2U);  // 0.75 s lies in a gap of half a second, 2.1 s beyond the end
  EXPECT_EQ(pairs[0].estimate_index, 0U);
  EXPECT_NEAR(pairs[0].truth.position.x(), 0.0, 1e-12);
  EXPECT_EQ(pairs[1].estimate_index, 1U);
  EXPECT_NEAR(pairs[1].truth.position.x(), 1.004, 1e-9);
}

TEST(Alignment, RecoversAKnownSimilarity) {
  const Trajectory truth = winding_path(200);
  const Similarity known{so3::exp({0.3, -1.2, 2.0}), {10.0, -4.0, 2.5}, 0.37};
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) {
    const Quaternion inverse = known.rotation.conjugate();
    pose.pose = {inverse * pose.pose.rotation, inverse * (pose.pose.position - known.translation) / known.scale};
  }
  const PosePairs pairs = pairs_of(estimate, truth);
  const auto found = find_alignment(pairs, Alignment::sim3);
  ASSERT_TRUE(found);
  EXPECT_LT(so3::log(known.rotation.conjugate() * found->rotation).norm(), 1e-12);
  EXPECT_LT((found->translation - known.translation).norm(), 1e-10);
  EXPECT_NEAR(found->scale, known.scale, 1e-12);
  EXPECT_LT(summarize(translation_errors(align(*found, pairs))).max, 1e-10);
  EXPECT_LT(summarize(angle_errors(align(*found, pairs))).max, 1e-7);
}

TEST(Alignment, NeverMirrors) {
  // A mirrored copy is matched best by a reflection, which is not a rotation.
  std::vector<Vector3> from{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  std::vector<Vector3> to = from;
  for (Vector3& point : to) point.x() = -point.x();
  const auto found = umeyama(from, to, false);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->rotation.toRotationMatrix().determinant(), 1.0, 1e-12);
}

TEST(Alignment, SaysWhenALineDoesNotFixTheRotation) {
  std::vector<Vector3> line;
  for (int i = 0; i < 100; ++i) line.push_back(Vector3(1000.0, -300.0, 5.0) + 0.1 * i * Vector3(1.0, 2.0, 3.0));
  EXPECT_FALSE(umeyama(line, line, false));
  EXPECT_FALSE(umeyama({}, {}, true));
  EXPECT_THROW(umeyama(line, {}, false), std::invalid_argument);
}

TEST(Alignment, OriginMakesTheFirstPosesCoincide) {
  const Trajectory truth = winding_path(20);
  const Pose offset{so3::exp({0.1, 0.2, 0.3}), {1, 2, 3}};
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) pose.pose = offset * pose.pose;
  const PosePairs pairs = pairs_of(estimate, truth);
  const PosePairs aligned = align(*find_alignment(pairs, Alignment::origin), pairs);
  EXPECT_LT(summarize(translation_errors(aligned)).max, 1e-12);
}

TEST(Errors, HeadingIsTheTurnAboutTheMapsZ) {
  PosePair pair;
  pair.truth.rotation = so3::exp({0.4, 1.3, -2.0});
  pair.estimate.rotation = so3::exp({0.0, 0.0, -3.0 * kDegree}) * pair.truth.rotation;
  EXPECT_NEAR(heading_errors({pair})[0], -3.0 * kDegree, 1e-12);
  EXPECT_NEAR(angle_errors({pair})[0], 3.0 * kDegree, 1e-12);
  pair.estimate.rotation = so3::exp({0.01, 0.0, 0.0}) * pair.truth.rotation;
  EXPECT_NEAR(heading_errors({pair})[0], 0.0, 1e-12);
}

TEST(Errors, RelativeErrorOfAConstantDriftIsItsRateTimesTheStretch) {
  // The estimate is too long by 1 % and rotates too much by 0.2° a metre, along a straight line at 0.1 m a pose.
  PosePairs pairs;
  const double excess = 0.01;
  for (int i = 0; i <= 100; ++i) {
    PosePair pair;
    const double travelled = 0.1 * i;
    pair.truth.position = {travelled, 0.0, 0.0};
    pair.estimate.position = {(1.0 + excess) * travelled, 0.0, 0.0};
    pair.estimate.rotation = so3::exp({0.2 * kDegree * travelled, 0.0, 0.0});  // about the line: positions stay
    pairs.push_back(pair);
  }
  const auto by_count = relative_errors(pairs, segments_by_count(pairs.size(), 10, false));
  ASSERT_EQ(by_count.size(), 10U);
  EXPECT_NEAR(summarize(translations_of(by_count)).rmse, excess, 1e-12);
  EXPECT_NEAR(summarize(angles_of(by_count)).rmse, 0.2 * kDegree, 1e-12);
  EXPECT_EQ(segments_by_count(pairs.size(), 10, true).size(), 91U);
  EXPECT_THROW(segments_by_count(5, 0, true), std::invalid_argument);

  // The length is that of the estimated path: 2.02 m are 20 steps.
  const auto segments = segments_by_distance(pairs, 2.0);
  EXPECT_EQ(segments.size(), 83U);  // 81 whole ones, then 1.919 m and 1.818 m are still within 10 % of 2 m
  const auto by_distance = relative_errors(pairs, {segments.begin(), segments.begin() + 81});
  EXPECT_NEAR(summarize(translations_of(by_distance)).max, 2.0 * excess, 1e-12);
  EXPECT_NEAR(summarize(translations_of(by_distance)).min, 2.0 * excess, 1e-12);
}

TEST(Errors, StretchesDoNotCareForAlignment) {
  const Trajectory truth = winding_path(100);
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) pose.pose.position.x() *= 1.02;
  const PosePairs pairs = pairs_of(estimate, truth);
  const PosePairs aligned = align(*find_alignment(pairs, Alignment::se3), pairs);
  const auto before = translations_of(relative_errors(pairs, segments_by_distance(pairs, 1.0)));
  const auto after = translations_of(relative_errors(aligned, segments_by_distance(aligned, 1.0)));
  EXPECT_NEAR(summarize(before).rmse, summarize(after).rmse, 1e-12);
}

TEST(Statistics, MatchHandComputedValues) {
  const ErrorStatistics statistics = summarize({4.0, 1.0, 3.0, 2.0});
  EXPECT_EQ(statistics.count, 4U);
  EXPECT_DOUBLE_EQ(statistics.rmse, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(statistics.mean, 2.5);
  EXPECT_DOUBLE_EQ(statistics.median, 2.5);
  EXPECT_DOUBLE_EQ(statistics.standard_deviation, std::sqrt(1.25));
  EXPECT_DOUBLE_EQ(statistics.min, 1.0);
  EXPECT_DOUBLE_EQ(statistics.max, 4.0);
  EXPECT_EQ(summarize({}).count, 0U);
}

TEST(Statistics, DistributionAndQuantileInvertEachOther) {
  const ErrorDistribution distribution({0.4, 0.1, 0.3, 0.2});
  EXPECT_DOUBLE_EQ(distribution.share_within(0.05), 0.0);
  EXPECT_DOUBLE_EQ(distribution.share_within(0.2), 0.5);
  EXPECT_DOUBLE_EQ(distribution.quantile(0.5), 0.2);
  EXPECT_DOUBLE_EQ(distribution.quantile(1.0), 0.4);
  EXPECT_DOUBLE_EQ(distribution.quantile(0.0), 0.1);
  EXPECT_THROW(ErrorDistribution({}).quantile(0.5), std::invalid_argument);
}

/// Pairs whose true error is drawn from each pose's covariance; the reported covariance is `claimed` times that.
Consistency of_drawn_errors(double claimed) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  PosePairs pairs;
  std::vector<Matrix6> covariances;
  for (int i = 0; i < 4000; ++i) {
    Matrix6 root = Matrix6::NullaryExpr([&]() { return normal(random); });
    root.topRows<3>() *= 0.003;    // rad
    root.bottomRows<3>() *= 0.05;  // m
    const Vector6 white = Vector6::NullaryExpr([&]() { return normal(random); });
    PosePair pair;
    pair.estimate = {so3::exp(Vector3::NullaryExpr([&]() { return normal(random); })), {1.0, 2.0, 3.0}};
    pair.truth = pair.estimate.boxplus(root * white);
    pairs.push_back(pair);
    covariances.push_back(claimed * root * root.transpose());
  }
  return evaluate_consistency(pairs, covariances);
}

TEST(Consistency, IsOneForErrorsDrawnFromTheCovariance) {
  const Consistency consistency = of_drawn_errors(1.0);
  EXPECT_EQ(consistency.count + consistency.singular, 4000U);
  EXPECT_GT(consistency.count, 3990U);
  EXPECT_NEAR(consistency.nees, 1.0, 0.04);  // sigma of the mean: sqrt(2 / 6 / 4000) = 0.009
  EXPECT_NEAR(consistency.nees_rotation, 1.0, 0.05);
  EXPECT_NEAR(consistency.nees_position, 1.0, 0.05);
  EXPECT_NEAR(consistency.share_within_95, 0.95, 0.015);
}

TEST(Consistency, OverconfidenceShowsAsItsFactor) {
  EXPECT_NEAR(of_drawn_errors(0.25).nees, 4.0, 0.16);
}

TEST(Consistency, IntervalHoldsTheTruthThoughErrorsStayTheSameForAWhile) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  int holds = 0;
  constexpr int kDraws = 300;
  for (int draw = 0; draw < kDraws; ++draw) {
    PosePairs pairs;
    Vector6 error = Vector6::Zero();
    for (int i = 0; i < 2000; ++i) {
      if (i % 50 == 0) error = Vector6::NullaryExpr([&]() { return 0.01 * normal(random); });
      PosePair pair;
      pair.truth = pair.estimate.boxplus(error);
      pairs.push_back(pair);
    }
    const Consistency found =
        evaluate_consistency(pairs, std::vector<Matrix6>(pairs.size(), 1e-4 * Matrix6::Identity()));
    if (found.nees_low <= 1.0 && 1.0 <= found.nees_high) ++holds;
  }
  // The interval would have exactly 95 % for normal means; means of squares are skewed. If poses were treated as
  // independent, it would contain the true value in only 22 % of the draws.
  EXPECT_GT(holds, 0.9 * kDraws);
  EXPECT_LT(holds, 0.99 * kDraws);
}

TEST(Consistency, LeavesOutSingularCovariances) {
  const Consistency consistency = evaluate_consistency(PosePairs(2), {Matrix6::Identity(), Matrix6::Zero()});
  EXPECT_EQ(consistency.count, 1U);
  EXPECT_EQ(consistency.singular, 1U);
  EXPECT_THROW(evaluate_consistency(PosePairs(2), {}), std::invalid_argument);
}

}  // namespace
}  // namespace lodestone
