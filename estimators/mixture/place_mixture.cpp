#include "estimators/mixture/place_mixture.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "core/imu/gap_noise.h"
#include "core/parallel.h"
#include "core/wheels/wheel_residual.h"
#include "estimators/baselines/field_matching.h"
#include "estimators/baselines/state_cloud.h"
#include "estimators/initial_state.h"
#include "estimators/layer_height.h"
#include "estimators/mixture/field_update.h"
#include "estimators/smoother/field_weighting.h"

namespace lodestone {

namespace {

constexpr std::size_t kMostComponents = 2000;
constexpr std::size_t kMostParts = 3 * kMostComponents;  ///< before they are merged
constexpr double kLeastWeight = 1e-6;                    ///< of the heaviest component's
/// Components in one bin are merged. Its sides in their sigmas: two equal normals that are no further apart have one
/// peak (Schilling, Watkins and Watkins 2002).
constexpr double kBinSigmas = 2.0;
/// Offsets of real sensors are not normal: a few drift. Sigma of the prior over that of the platform file.
constexpr double kOffsetSpread = 2.0;
constexpr double kStudentDegrees = 4.0;  ///< Lange, Little and Taylor 1989

/// A normal distribution as three, that in its middle first (Huber 2011, table of splits), with the variance that keeps
/// that of the whole.
struct Part {
  double shift_sigmas;
  double weight;
};
constexpr std::array<Part, 3> kParts{Part{0.0, 0.5496}, Part{-1.0567, 0.2252}, Part{1.0567, 0.2252}};
/// Share of the variance that leaves each part.
constexpr double kSplitOff = 2.0 * 0.2252 * 1.0567 * 1.0567;

constexpr Eigen::Index kOffsets = tangent::size;

using Vector1 = Eigen::Matrix<double, 1, 1>;

/// The side of a bin for components with this variance: a power of two, so that alike components share their bins. A
/// variance that rounding made zero or negative has a side, too: the bins' order requires numbers.
double bin_side(double variance) {
  constexpr double least = 1e-12;
  return std::exp2(std::round(0.5 * std::log2(kBinSigmas * kBinSigmas * std::max(least, variance))));
}

bool heavier(const PlaceComponent& a, const PlaceComponent& b) {
  return a.log_weight > b.log_weight;
}

/// Components in one bin of `dimensions` coordinates of position and velocity, and of heading, become one. `scale`: of
/// the bins' sides. `components` and the result: the heaviest first.
std::vector<PlaceComponent> merged_in_bins(std::vector<PlaceComponent> components, double scale,
                                           std::size_t dimensions) {
  using Bin = std::array<double, 10>;
  std::map<Bin, std::vector<PlaceComponent*>> bins;  // the heaviest first in each
  for (PlaceComponent& one : components) {
    const auto variances = one.covariance.diagonal();
    const double side_m = scale * bin_side(variances.segment<2>(tangent::position).mean());
    const double side_m_s = scale * bin_side(variances.segment<2>(tangent::velocity).mean());
    const double side_rad = scale * bin_side(variances[tangent::rotation + 2]);
    Bin bin{};
    for (std::size_t k = 0; k < dimensions; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      bin[k] = std::floor(one.state.T_map_imu.position[axis] / side_m);
      bin[3 + k] = std::floor(one.state.velocity[axis] / side_m_s);
    }
    bin[6] = std::floor(heading_rad(one.state.T_map_imu.rotation) / side_rad);
    bin[7] = side_m;
    bin[8] = side_m_s;
    bin[9] = side_rad;
    bins[bin].push_back(&one);
  }
  std::vector<const std::vector<PlaceComponent*>*> groups;
  groups.reserve(bins.size());
  for (const auto& [bin, members] : bins) groups.push_back(&members);
  std::vector<PlaceComponent> result(groups.size());
  parallel_for(
      std::size_t{0}, groups.size(),
      [&](std::size_t i) {
        const std::vector<PlaceComponent*>& group = *groups[i];
        result[i] = group.size() == 1 ? std::move(*group.front()) : merged_place({group.begin(), group.end()});
      },
      16);
  std::stable_sort(result.begin(), result.end(), heavier);
  return result;
}

/// `body(some)` in parallel for pieces of the components: what it allocates serves all components of a piece.
template <class Body>
void in_pieces(std::span<PlaceComponent> components, const Body& body) {
  constexpr std::size_t kPiece = 16;
  parallel_for(std::size_t{0}, (components.size() + kPiece - 1) / kPiece, [&](std::size_t i) {
    body(components.subspan(i * kPiece, std::min(kPiece, components.size() - i * kPiece)));
  });
}

/// Kalman update of a component by one measurement. `H`: the residual's derivative by the first components of its
/// error. Returns the covariance of the residual.
template <int kRows, int kColumns>
Eigen::Matrix<double, kRows, kRows> update_by(const Eigen::Matrix<double, kRows, 1>& residual,
                                              const Eigen::Matrix<double, kRows, kColumns>& H,
                                              const Eigen::Matrix<double, kRows, kRows>& noise,
                                              PlaceComponent& component) {
  Eigen::MatrixXd& P = component.covariance;
  const Eigen::Matrix<double, Eigen::Dynamic, kRows> crossed =
      P.template leftCols<kColumns>().lazyProduct(H.transpose());
  const Eigen::Matrix<double, kRows, kRows> innovation = H * crossed.template topRows<kColumns>() + noise;
  const Eigen::Matrix<double, Eigen::Dynamic, kRows> gain = crossed.lazyProduct(innovation.inverse());
  P -= gain.lazyProduct(crossed.transpose());
  P.template triangularView<Eigen::StrictlyUpper>() = P.transpose();
  component.move(-gain * residual);
  return innovation;
}

}  // namespace

PlaceMixture::PlaceMixture(const EstimatorInput& input)
    : input_(input),
      background_(field_background(*input.field)),
      correlation_m_(map_correlation_m(input.options.magnetic, *input.field)),
      crowding_(mean_crowding(input.suite, correlation_m_)) {
  const InitialState initial =
      initial_state(input.initial_pose, input.initial_velocity, input.suite.gravity_m_s2, input.options.initial);
  const auto offsets = 3 * static_cast<Eigen::Index>(input.suite.magnetometers.size());
  PlaceComponent first;
  first.state = initial.state;
  first.offsets_ut = Eigen::VectorXd::Zero(offsets);
  first.covariance = Eigen::MatrixXd::Zero(kOffsets + offsets, kOffsets + offsets);
  first.covariance.topLeftCorner<tangent::size, tangent::size>() = initial.covariance;
  first.covariance.diagonal().tail(offsets).setConstant(
      std::pow(kOffsetSpread * input.suite.calibration.magnetometers.offset_sigma_ut, 2));
  components_.push_back(std::move(first));
}

void PlaceMixture::process(const ScanBundle& bundle) {
  for (std::size_t i = 0; i < components_.size(); ++i) components_[i].parent = i;
  predict(bundle);
  split();
  if (input_.field->grid().heights_m.size() == 1) {
    parallel_for(
        std::size_t{0}, components_.size(), [&](std::size_t i) { update_height(components_[i]); }, 16);
  }
  wheel_weight_ = -1.0;
  if (input_.suite.wheels && !bundle.imu.empty()) update_wheels(bundle);
  if (!bundle.magnetic.empty() && !bundle.imu.empty()) {
    const NavState& heaviest = components_.front().state;
    const std::vector<ArrayReading> arrays = average_array(bundle.magnetic, ScanMotion(heaviest, bundle.imu),
                                                           input_.suite, input_.options.magnetic.samples_per_reading);
    const double way_m = heaviest.velocity.norm() * to_seconds(bundle.imu.back().time - bundle.imu.front().time);
    if (!has_readings_ && !arrays.empty()) doubt_offsets(arrays.front());
    has_readings_ = has_readings_ || !arrays.empty();
    for (const ArrayReading& array : arrays) update(array, way_m / static_cast<double>(arrays.size()));
  }
  reduce();
}

void PlaceMixture::predict(const ScanBundle& bundle) {
  const std::span<const ImuSample> imu = bundle.imu;
  increment_.reset();
  if (imu.size() < 2) return;
  imu_white_noise_.add(imu);
  const ImuNoise noise = with_gap(imu_white_noise_.bound(input_.suite.imu), bundle.imu_gap_s);
  const NavState& heaviest = components_.front().state;
  increment_.emplace(imu, heaviest.gyroscope_bias, heaviest.accelerometer_bias, noise);
  in_pieces(components_, [&](std::span<PlaceComponent> some) {
    Eigen::MatrixXd crossed;
    for (PlaceComponent& one : some) predict_place(*increment_, noise, one, crossed);
  });
}

void PlaceMixture::split() {
  constexpr int rounds = 12;
  for (int round = 0; round < rounds; ++round) {
    // The step of a sigma along the largest axis; empty if the component need not be split.
    std::vector<Eigen::VectorXd> steps(components_.size());
    parallel_for(
        std::size_t{0}, components_.size(),
        [&](std::size_t i) {
          const Eigen::MatrixXd& P = components_[i].covariance;
          const Matrix3 position = P.block<3, 3>(tangent::position, tangent::position);
          const Eigen::SelfAdjointEigenSolver<Matrix3> solver(position);
          const double sigma_m = std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
          if (sigma_m > kWidestPlace_m) {
            steps[i] = P.middleCols<3>(tangent::position) * solver.eigenvectors().col(2) / sigma_m;
          }
        },
        16);
    const std::size_t before = components_.size();
    for (std::size_t i = 0; i < before && components_.size() <= kMostParts; ++i) {
      if (steps[i].size() == 0) continue;
      components_[i].covariance -= kSplitOff * steps[i] * steps[i].transpose();
      components_[i].log_weight += std::log(kParts[0].weight);
      for (std::size_t k = 1; k < kParts.size(); ++k) {
        components_.push_back(components_[i]);
        components_.back().move(kParts[k].shift_sigmas * steps[i]);
        components_.back().log_weight += std::log(kParts[k].weight / kParts[0].weight);
      }
    }
    if (components_.size() == before) return;
    std::stable_sort(components_.begin(), components_.end(), heavier);
  }
}

void PlaceMixture::update_height(PlaceComponent& component) const {
  const Vector3 center = array_center(input_.suite);
  const Eigen::Matrix<double, 1, 6> H = height_by_pose(component.state.T_map_imu, center);
  const double above_m = (component.state.T_map_imu * center).z() - input_.field->grid().heights_m.front();
  update_by<1, 6>(Vector1(above_m), H, Vector1(kLayerHeightSigma_m * kLayerHeightSigma_m), component);
}

void PlaceMixture::update_wheels(const ScanBundle& bundle) {
  const WheelCalibrationSigmas& sigmas = input_.suite.calibration.wheels;
  const PlaceComponent& heaviest = components_.front();
  auto reading = average_wheels(bundle.wheels, heaviest.state, bundle.imu, *input_.suite.wheels);
  if (!reading) return;
  const Matrix17 covariance = heaviest.covariance.topLeftCorner<tangent::size, tangent::size>();
  wheel_weight_ = weigh_wheels(heaviest.state, covariance, {}, sigmas, kWheelProbability, *reading);
  const double step_s = to_seconds(bundle.imu.back().time - bundle.imu.front().time);
  parallel_for(
      std::size_t{0}, components_.size(),
      [&](std::size_t i) {
        PlaceComponent& component = components_[i];
        const NavState& state = component.state;
        const WheelResidual predicted =
            wheel_residual(*reading, state.T_map_imu.rotation, state.velocity, state.gyroscope_bias, {});
        const Matrix3 innovation = update_by<3, tangent::size>(predicted.value, predicted.by_state(),
                                                               wheel_noise(predicted, sigmas, step_s), component);
        component.log_weight -=
            0.5 * (std::log(innovation.determinant()) + predicted.value.dot(innovation.inverse() * predicted.value));
      },
      16);
}

/// Some magnetometers drift far beyond the sigma of the platform file, and Student's weights still move the pose by
/// them. Before the first update, an offset becomes as uncertain as its magnetometer is apart from the middle of the
/// array, if the sigmas let expect less. A wrong pose hardly changes this difference.
void PlaceMixture::doubt_offsets(const ArrayReading& array) {
  std::vector<ReadingFit> fits;
  std::vector<Vector3> residuals_ut;
  for (const MeanReading& reading : array.readings) {
    fits.push_back(fit_reading(reading, components_.front(), input_, background_));
    residuals_ut.push_back(fits.back().residual_ut);
  }
  const Vector3 middle_ut = middle_of(residuals_ut);
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const double apart_ut2 = (fits[i].residual_ut - middle_ut).squaredNorm();
    const Eigen::Index offset = kOffsets + 3 * array.readings[i].magnetometer;
    const double known_ut2 = components_.front().covariance(offset, offset) + fits[i].variance_ut2();
    if (apart_ut2 < 3.0 * known_ut2) continue;  // the expectation, of three axes
    for (PlaceComponent& one : components_) one.covariance.diagonal().segment<3>(offset).setConstant(apart_ut2);
  }
}

/// The variance of single readings over that of their mean if errors of the map repeat
/// (docs/design/013-correlated-field-map-error.md). One share serves all components, so that these are comparable.
double PlaceMixture::information_share(const ArrayReading& array, double spacing_m) const {
  const double repeats = correlation_inflation(spacing_m, correlation_m_);
  double single = 0.0, repeated = 0.0;
  for (const MeanReading& reading : array.readings) {
    const ReadingFit found = fit_reading(reading, components_.front(), input_, background_);
    single += found.variance_ut2();
    repeated += repeats * (found.sensor_variance_ut2 + crowding_ * found.map_variance_ut2);
  }
  return repeated > single ? single / repeated : 1.0;
}

/// A place off the map predicts a field of the map's distribution, no more: that it is off is no evidence against it.
void PlaceMixture::update(const ArrayReading& array, double spacing_m) {
  if (array.readings.empty()) return;
  const double share = information_share(array, spacing_m);
  in_pieces(components_, [&](std::span<PlaceComponent> some) {
    std::vector<WeighedFit> readings;
    for (PlaceComponent& component : some) {
      readings.clear();
      for (const MeanReading& reading : array.readings) {
        const ReadingFit found = fit_reading(reading, component, input_, background_);
        const double spread = found.informs ? mean_variance_ut2(component.covariance, found) : 0.0;
        const double total = found.variance_ut2() + spread;
        const double squared = found.residual_ut.squaredNorm() / total;
        component.log_weight -=
            share * (1.5 * std::log(total) + 0.5 * (kStudentDegrees + 3.0) * std::log1p(squared / kStudentDegrees));
        if (!found.informs) continue;
        const double robust = std::max(1.0, (kStudentDegrees + squared) / (kStudentDegrees + 3.0));
        readings.push_back({found, found.variance_ut2() * robust / share});
      }
      update_by_readings(readings, component);
    }
  });
}

void PlaceMixture::reduce() {
  const auto weighted = [](const PlaceComponent& one) { return std::isfinite(one.log_weight); };
  // If no weight is finite, the component that was the heaviest before the update remains, and health judges it.
  if (std::none_of(components_.begin(), components_.end(), weighted)) components_.front().log_weight = 0.0;
  std::erase_if(components_, [&](const PlaceComponent& one) { return !weighted(one); });
  std::stable_sort(components_.begin(), components_.end(), heavier);
  const double least = components_.front().log_weight + std::log(kLeastWeight);
  std::erase_if(components_, [&](const PlaceComponent& one) { return !(one.log_weight > least); });
  // On a map with one height, the height is known, and a bin's edge at it would double the components.
  const std::size_t dimensions = input_.field->grid().heights_m.size() == 1 ? 2 : 3;
  components_ = merged_in_bins(std::move(components_), 1.0, dimensions);
  // If there are too many, light ones are merged in larger bins. None is discarded: the covariance would shrink.
  for (double scale = 1.5; components_.size() > kMostComponents && scale < 1e3; scale *= 1.5) {
    constexpr auto kept = static_cast<std::ptrdiff_t>(kMostComponents - kMostComponents / 10);
    std::vector<PlaceComponent> light(std::make_move_iterator(components_.begin() + kept),
                                      std::make_move_iterator(components_.end()));
    components_.resize(kept);
    for (PlaceComponent& one : merged_in_bins(std::move(light), scale, dimensions)) {
      components_.push_back(std::move(one));
    }
    std::stable_sort(components_.begin(), components_.end(), heavier);
  }
  double sum = 0.0;
  for (const PlaceComponent& one : components_) sum += std::exp(one.log_weight - components_.front().log_weight);
  const double total = components_.front().log_weight + std::log(sum);
  for (PlaceComponent& one : components_) one.log_weight -= total;
}

}  // namespace lodestone
