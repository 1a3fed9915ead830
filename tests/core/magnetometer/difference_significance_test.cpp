// False places of simulated maps of one field against the stated level, and changes that must be found.
#include "core/magnetometer/difference_significance.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

namespace lodestone {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLevel = 0.05;
constexpr double kSpacing_m = 0.1;

/// exp(−(i − j)² h² / 2 l²) of equidistant points; l = 0: the identity.
MatrixXd line_correlation(int points, double length_scale_m) {
  MatrixXd result(points, points);
  for (int i = 0; i < points; ++i) {
    for (int j = 0; j < points; ++j) {
      const double steps = kSpacing_m * (i - j) / std::max(length_scale_m, 1e-9);
      result(i, j) = std::exp(-0.5 * steps * steps);
    }
  }
  return result;
}

MatrixXd symmetric_root(const MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(covariance);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         solver.eigenvectors().transpose();
}

/// Draws fields of unit variance with a squared-exponential correlation.
class FieldDraw {
 public:
  FieldDraw(int rows, int columns, double length_scale_m)
      : along_y_(symmetric_root(line_correlation(rows, length_scale_m))),
        along_x_(symmetric_root(line_correlation(columns, length_scale_m))) {}

  MatrixXd operator()(std::mt19937_64& generator) const {
    std::normal_distribution<double> normal;
    return along_y_ * MatrixXd::NullaryExpr(along_y_.rows(), along_x_.rows(), [&]() { return normal(generator); }) *
           along_x_;
  }

 private:
  MatrixXd along_y_, along_x_;
};

using FieldLayer = std::array<MatrixXd, 3>;

MagneticMap map_of_layer(const FieldLayer& field, const MatrixXd& sigma_ut) {
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < sigma_ut.rows(); ++row) {
    for (int column = 0; column < sigma_ut.cols(); ++column) {
      nodes.push_back(
          Eigen::Vector4d(field[0](row, column), field[1](row, column), field[2](row, column), sigma_ut(row, column))
              .cast<float>());
    }
  }
  const FieldGrid grid{
      kSpacing_m, {0.0, 0.0}, static_cast<int>(sigma_ut.cols()), static_cast<int>(sigma_ut.rows()), {0.3}};
  return {grid, nodes, 100.0};
}

double most_sigmas(const MagneticDifference& difference) {
  float most = 0.0F;
  for (const DifferencePiece& piece : difference.pieces) {
    for (const Eigen::Vector4f& node : piece.nodes) {
      if (node[3] > most) most = node[3];
    }
  }
  return most;
}

/// The p-value of the largest normalized difference: a false place is reported where it is at most the level.
double least_p_value(const MagneticMap& first, const MagneticMap& second) {
  const MagneticDifference difference = compare_maps(first, second);
  return DifferenceSignificance(difference).p_value(most_sigmas(difference));
}

/// Three standard deviations of a count of `trials` at the level.
double count_margin(int trials) {
  return 3.0 * std::sqrt(trials * kLevel * (1.0 - kLevel));
}

struct UnchangedRoom {
  const char* name;
  int rows, columns;
  double length_scale_m;
  double true_over_stated;  ///< the sigmas of the errors that were drawn
};

class UnchangedRooms : public ::testing::TestWithParam<UnchangedRoom> {
 protected:
  /// How many of `pairs` maps of one field have a place with a p-value of at most the level.
  int false_alarms(int pairs) const {
    const UnchangedRoom& room = GetParam();
    const FieldDraw draw(room.rows, room.columns, room.length_scale_m);
    // The second map is half as certain at one end of the room as at the other.
    const MatrixXd first_sigma = MatrixXd::Constant(room.rows, room.columns, 0.3);
    const MatrixXd second_sigma = VectorXd::Ones(room.rows) * VectorXd::LinSpaced(room.columns, 0.3, 0.6).transpose();
    std::mt19937_64 generator(20261);
    int alarms = 0;
    for (int pair = 0; pair < pairs; ++pair) {
      FieldLayer first, second;
      for (int k = 0; k < 3; ++k) {
        first[k] = room.true_over_stated * draw(generator).cwiseProduct(first_sigma);
        second[k] = room.true_over_stated * draw(generator).cwiseProduct(second_sigma);
      }
      alarms += least_p_value(map_of_layer(first, first_sigma), map_of_layer(second, second_sigma)) <= kLevel;
    }
    return alarms;
  }
};

TEST_P(UnchangedRooms, HaveFalsePlacesAtTheStatedRate) {
  constexpr int pairs = 1000;
  const int alarms = false_alarms(pairs);
  RecordProperty("false_alarms", alarms);
  EXPECT_LE(alarms, pairs * kLevel + count_margin(pairs));
  // The factor of the sigmas is never below 1: where they are right, chance makes it too large in half of the pairs.
  if (GetParam().true_over_stated > 1.0) {
    EXPECT_GE(alarms, pairs * kLevel - count_margin(pairs));
  }
  EXPECT_GT(alarms, 0);
}

INSTANTIATE_TEST_SUITE_P(
    DifferenceSignificance, UnchangedRooms,
    ::testing::Values(UnchangedRoom{"honest", 61, 81, 0.4, 1.0}, UnchangedRoom{"understated", 61, 81, 0.4, 2.0},
                      UnchangedRoom{"smooth", 61, 81, 0.7, 2.0}, UnchangedRoom{"corridor", 15, 200, 0.4, 1.5},
                      UnchangedRoom{"independent", 61, 81, 0.0, 2.0}, UnchangedRoom{"small", 31, 31, 0.4, 2.7}),
    [](const auto& info) { return info.param.name; });

/// Maps of one field by Gaussian-process regression of two drives, with the posterior's sigma: the exact errors of such
/// maps, correlated, of uneven sigma, and in part common to both.
class RegressedRoom {
 public:
  RegressedRoom() : draw_(kRows, kColumns, kLengthScale_m) {
    for (int drive = 0; drive < 2; ++drive) {
      for (int row = 3 + 2 * drive; row < kRows; row += 7) {
        for (int column = 0; column < kColumns; column += 2) cells_[drive].emplace_back(row, column);
      }
      const auto count = static_cast<Eigen::Index>(cells_[drive].size());
      MatrixXd among(count, count), to_nodes(kRows * kColumns, count);
      const MatrixXd along_y = line_correlation(kRows, kLengthScale_m);
      const MatrixXd along_x = line_correlation(kColumns, kLengthScale_m);
      for (Eigen::Index j = 0; j < count; ++j) {
        const auto [row, column] = cells_[drive][j];
        const MatrixXd covariance = along_y.col(row) * along_x.row(column);
        to_nodes.col(j) = covariance.reshaped();
        for (Eigen::Index i = 0; i < count; ++i) {
          among(i, j) = covariance(cells_[drive][i].first, cells_[drive][i].second);
        }
      }
      among.diagonal().array() += kNoise * kNoise;
      gain_[drive] = among.llt().solve(to_nodes.transpose()).transpose();
      const VectorXd variance = 1.0 - gain_[drive].cwiseProduct(to_nodes).rowwise().sum().array();
      sigma_ut_[drive] = kSignal_ut * variance.cwiseSqrt().reshaped(kRows, kColumns);
    }
  }

  /// The map that a drive makes of `field`.
  MagneticMap map(int drive, const FieldLayer& field, std::mt19937_64& generator) const {
    std::normal_distribution<double> normal;
    FieldLayer mean;
    for (int k = 0; k < 3; ++k) {
      VectorXd readings(cells_[drive].size());
      for (Eigen::Index i = 0; i < readings.size(); ++i) {
        const auto [row, column] = cells_[drive][i];
        readings[i] = field[k](row, column) + kSignal_ut * kNoise * normal(generator);
      }
      mean[k] = (gain_[drive] * readings).reshaped(kRows, kColumns);
    }
    return map_of_layer(mean, sigma_ut_[drive]);
  }

  FieldLayer field(std::mt19937_64& generator) const {
    FieldLayer result;
    for (MatrixXd& component : result) component = kSignal_ut * draw_(generator);
    return result;
  }

  static constexpr int kRows = 36, kColumns = 50;

 private:
  static constexpr double kLengthScale_m = 0.5, kSignal_ut = 8.0, kNoise = 0.1;
  FieldDraw draw_;
  std::vector<std::pair<int, int>> cells_[2];
  MatrixXd gain_[2], sigma_ut_[2];
};

TEST(DifferenceSignificance, MapsOfTwoDrivesThroughOneFieldHaveFalsePlacesAtMostAtTheStatedRate) {
  constexpr int pairs = 400;
  const RegressedRoom room;
  std::mt19937_64 generator(20262);
  int alarms = 0;
  for (int pair = 0; pair < pairs; ++pair) {
    const FieldLayer field = room.field(generator);
    alarms += least_p_value(room.map(0, field, generator), room.map(1, field, generator)) <= kLevel;
  }
  RecordProperty("false_alarms", alarms);
  EXPECT_LE(alarms, pairs * kLevel + count_margin(pairs));
}

TEST(DifferenceSignificance, FindsSteelThatCame) {
  const RegressedRoom room;
  std::mt19937_64 generator(20263);
  for (int pair = 0; pair < 20; ++pair) {
    FieldLayer field = room.field(generator);
    const MagneticMap before = room.map(0, field, generator);
    for (int row = 0; row < RegressedRoom::kRows; ++row) {
      for (int column = 0; column < RegressedRoom::kColumns; ++column) {
        // µT above a vertical dipole of 40 A m² in the middle, 0.8 m below: 0.1 m (3 cos² − 1) / r³.
        const double across = kSpacing_m * std::hypot(row - 18.0, column - 25.0);
        const double square = across * across + 0.64;
        field[2](row, column) += 4.0 * (3.0 * 0.64 / square - 1.0) / std::pow(square, 1.5);
      }
    }
    EXPECT_LT(least_p_value(before, room.map(1, field, generator)), 1e-3) << pair;
  }
}

TEST(DifferenceSignificance, EstimatesTheScaleOfTheSigmasInSpiteOfAChange) {
  const FieldDraw draw(100, 150, 0.3);
  const MatrixXd sigma = MatrixXd::Constant(100, 150, 0.2);
  std::mt19937_64 generator(20264);
  FieldLayer first, second;
  for (int k = 0; k < 3; ++k) {
    first[k] = 2.0 * 0.2 * draw(generator);
    second[k] = 2.0 * 0.2 * draw(generator);
    second[k].block(40, 40, 20, 30).array() += 15.0;  // 4 % of the room
  }
  const DifferenceSignificance significance(compare_maps(map_of_layer(first, sigma), map_of_layer(second, sigma)));
  EXPECT_NEAR(significance.sigma_scale(), 2.0, 0.2);
  // The slope between nodes of a kernel of 0.3 m is that of one of 0.3042 m.
  EXPECT_NEAR(significance.correlation_length_m(), 0.304, 0.03);
  EXPECT_LT(significance.p_value(15.0 * std::sqrt(3.0) / 0.2 / std::sqrt(2.0)), 1e-12);
}

TEST(DifferenceSignificance, SigmasThatAreTooLargeAreKept) {
  const FieldDraw draw(61, 81, 0.3);
  const MatrixXd sigma = MatrixXd::Constant(61, 81, 0.5);
  std::mt19937_64 generator(20265);
  FieldLayer first, second;
  for (int k = 0; k < 3; ++k) {
    first[k] = 0.2 * draw(generator);
    second[k] = 0.2 * draw(generator);
  }
  const DifferenceSignificance significance(compare_maps(map_of_layer(first, sigma), map_of_layer(second, sigma)));
  EXPECT_NEAR(significance.median_ratio(), 0.4, 0.05);
  EXPECT_EQ(significance.sigma_scale(), 1.0);
}

TEST(DifferenceSignificance, PValuesFallAndReachTheLevelAtTheCriticalValue) {
  const FieldDraw draw(31, 41, 0.3);
  const MatrixXd sigma = MatrixXd::Constant(31, 41, 0.2);
  std::mt19937_64 generator(20266);
  FieldLayer first, second;
  for (int k = 0; k < 3; ++k) {
    first[k] = 0.3 * draw(generator);
    second[k] = 0.3 * draw(generator);
  }
  const DifferenceSignificance significance(compare_maps(map_of_layer(first, sigma), map_of_layer(second, sigma)));
  EXPECT_EQ(significance.p_value(0.0), 1.0);
  for (double sigmas = 0.0; sigmas < 20.0; sigmas += 0.1) {
    EXPECT_LE(significance.p_value(sigmas + 0.1), significance.p_value(sigmas)) << sigmas;
  }
  for (const double level : {0.5, 0.05, 1e-4}) {
    const double critical = significance.critical_sigmas(level) * significance.sigma_scale();
    EXPECT_NEAR(significance.p_value(critical), level, 1e-9);
  }
  // More than the squares of a correlation length a side, fewer than the nodes.
  EXPECT_GT(significance.independent_places(0.05), 3.0 * 4.0 / 0.09);
  EXPECT_LT(significance.independent_places(0.05), 31 * 41);
}

TEST(DifferenceSignificance, EqualMapsHaveNoPlaceByChance) {
  const MatrixXd sigma = MatrixXd::Constant(20, 30, 0.2);
  const MatrixXd field = MatrixXd::Constant(20, 30, 20.0);
  const MagneticMap map = map_of_layer({field, field, field}, sigma);
  const DifferenceSignificance significance(compare_maps(map, map));
  EXPECT_EQ(significance.sigma_scale(), 1.0);
  EXPECT_EQ(significance.correlation_length_m(), 0.0);
  EXPECT_EQ(significance.p_value(1.0), 1.0);
  EXPECT_LT(significance.p_value(10.0), 1e-12);
}

}  // namespace
}  // namespace lodestone
