#include "estimators/mixture/place_mixture.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/imu/gap_noise.h"
#include "core/parallel.h"
#include "core/wheels/wheel_residual.h"
#include "estimators/baselines/field_matching.h"
#include "estimators/baselines/state_cloud.h"
#include "estimators/initial_state.h"
#include "estimators/layer_height.h"
#include "estimators/smoother/field_weighting.h"

namespace lodestone {

namespace {

constexpr std::size_t kMostComponents = 2000;
constexpr std::size_t kMostParts = 3 * kMostComponents;  ///< before they are merged
constexpr double kLeastWeight = 1e-6;                    ///< of the heaviest component's
/// Largest sigma of a component's position, m: a third of the smallest length scale of fields near steel (0.24 m).
constexpr double kWidest_m = 0.08;
/// Components in one bin are merged.
constexpr double kBin_m = 0.05, kBin_rad = 0.05, kBin_m_s = 0.1;
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

bool heavier(const PlaceComponent& a, const PlaceComponent& b) {
  return a.log_weight > b.log_weight;
}

/// Components in one bin of `dimensions` coordinates of position and velocity, and of heading, become one. `scale`: of
/// the bins' sides. `components` and the result: the heaviest first.
std::vector<PlaceComponent> merged_in_bins(std::vector<PlaceComponent> components, double scale,
                                           std::size_t dimensions) {
  using Bin = std::array<double, 7>;
  std::map<Bin, std::vector<const PlaceComponent*>> bins;  // the heaviest first in each
  for (const PlaceComponent& one : components) {
    Bin bin{};
    for (std::size_t k = 0; k < dimensions; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      bin[k] = std::floor(one.state.T_map_imu.position[axis] / (scale * kBin_m));
      bin[3 + k] = std::floor(one.state.velocity[axis] / (scale * kBin_m_s));
    }
    bin[6] = std::floor(heading_rad(one.state.T_map_imu.rotation) / (scale * kBin_rad));
    bins[bin].push_back(&one);
  }
  std::vector<const std::vector<const PlaceComponent*>*> groups;
  groups.reserve(bins.size());
  for (const auto& [bin, members] : bins) groups.push_back(&members);
  std::vector<PlaceComponent> result(groups.size());
  parallel_for(
      std::size_t{0}, groups.size(), [&](std::size_t i) { result[i] = merged_place(*groups[i]); }, 16);
  std::stable_sort(result.begin(), result.end(), heavier);
  return result;
}

/// Kalman update of the covariance and of `step`, which is added to the state at the end, by residual + H step. `H`:
/// rows×n. Returns the covariance of the residual.
template <int kRows>
Eigen::Matrix<double, kRows, kRows> correct(const Eigen::Matrix<double, kRows, 1>& residual,
                                            const Eigen::Matrix<double, kRows, Eigen::Dynamic>& H,
                                            const Eigen::Matrix<double, kRows, kRows>& noise,
                                            Eigen::MatrixXd& covariance, Eigen::VectorXd& step) {
  const Eigen::Matrix<double, Eigen::Dynamic, kRows> crossed = covariance.lazyProduct(H.transpose());
  const Eigen::Matrix<double, kRows, kRows> innovation = H.lazyProduct(crossed) + noise;
  const Eigen::Matrix<double, Eigen::Dynamic, kRows> gain = crossed.lazyProduct(innovation.inverse());
  step -= gain * (residual + H * step);
  covariance -= gain.lazyProduct(crossed.transpose());
  return innovation;
}

void make_symmetric(Eigen::MatrixXd& matrix) {
  matrix.triangularView<Eigen::StrictlyUpper>() = matrix.transpose();
}

/// The same for one measurement of a component. `H`: the residual's derivative by the first components of its state.
template <int kRows, int kColumns>
Eigen::Matrix<double, kRows, kRows> update_by(const Eigen::Matrix<double, kRows, 1>& residual,
                                              const Eigen::Matrix<double, kRows, kColumns>& H,
                                              const Eigen::Matrix<double, kRows, kRows>& noise,
                                              PlaceComponent& component) {
  const Eigen::Index size = component.covariance.cols();
  Eigen::Matrix<double, kRows, Eigen::Dynamic> padded(kRows, size);
  padded.setZero();
  padded.template leftCols<kColumns>() = H;
  Eigen::VectorXd step = Eigen::VectorXd::Zero(size);
  const auto innovation = correct<kRows>(residual, padded, noise, component.covariance, step);
  make_symmetric(component.covariance);
  component.move(step);
  return innovation;
}

/// A third of the trace of H P Hᵀ.
double mean_variance(const Eigen::MatrixXd& P, const Eigen::Matrix<double, 3, Eigen::Dynamic>& H) {
  const Eigen::Matrix<double, Eigen::Dynamic, 3> crossed = P.lazyProduct(H.transpose());
  return crossed.cwiseProduct(H.transpose()).sum() / 3.0;
}

/// Wider than the structure of the field: the gradient at the mean says nothing. Such a component exists where there
/// are too many to be split.
bool is_wide(const PlaceComponent& component) {
  const double variance = component.covariance.diagonal().segment<2>(tangent::position).maxCoeff();
  return variance > 4.0 * kWidest_m * kWidest_m;
}

/// A reading at a component: predicted minus measured field, map axes.
struct ReadingFit {
  bool informs = false;  ///< false: the field may be any of the map
  Vector3 residual_ut = Vector3::Zero();
  double sensor_variance_ut2 = 0.0;  ///< per component
  double map_variance_ut2 = 0.0;
  double variance_ut2() const { return sensor_variance_ut2 + map_variance_ut2; }
};

/// `H`: the residual's derivative, 3×n; zero off the map.
ReadingFit fit(const MeanReading& reading, const PlaceComponent& component, const EstimatorInput& input,
               const FieldBackground& background, Eigen::Matrix<double, 3, Eigen::Dynamic>& H) {
  const Pose& T_map_imu = component.state.T_map_imu;
  const Matrix3 R = T_map_imu.rotation.toRotationMatrix();
  const Matrix3 R_imu_mag = reading.T_end_mag.rotation.toRotationMatrix();
  const Eigen::Index at = 3 * reading.magnetometer;
  const Vector3 measured_ut = R_imu_mag * (reading.measured_ut - component.offsets_ut.segment<3>(at));
  const MagnetometerCalibrationSigmas& calibration = input.suite.calibration.magnetometers;
  const double noise_ut = input.suite.magnetometers[static_cast<std::size_t>(reading.magnetometer)].noise_ut;
  const double relative = std::hypot(calibration.rotation_sigma_deg * M_PI / 180.0, calibration.matrix_sigma);
  ReadingFit result;
  result.sensor_variance_ut2 =
      noise_ut * noise_ut / reading.samples + relative * relative * measured_ut.squaredNorm() / 3.0;
  H.setZero(3, component.covariance.cols());
  const auto field = input.field->query(T_map_imu * reading.T_end_mag.position, FieldInterpolation::bicubic);
  if (!field || is_wide(component)) {
    result.residual_ut = background.mean_ut - R * measured_ut;
    result.map_variance_ut2 = background.sigma_ut * background.sigma_ut;
    return result;
  }
  result.informs = true;
  result.residual_ut = field->field_ut - R * measured_ut;
  const double by_place_ut = calibration.translation_sigma_m * field->gradient.norm() / std::sqrt(3.0);
  result.map_variance_ut2 = std::pow(std::max(field->sigma_ut, kMapSigmaFloor_ut), 2) + by_place_ut * by_place_ut;
  H.middleCols<3>(tangent::rotation) =
      R * so3::hat(measured_ut) - field->gradient * R * so3::hat(reading.T_end_mag.position);
  H.middleCols<3>(tangent::position) = field->gradient;
  H.middleCols<3>(kOffsets + at) = R * R_imu_mag;
  return result;
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
  parallel_for(
      std::size_t{0}, components_.size(),
      [&](std::size_t i) { components_[i] = predicted_place(components_[i], *increment_, noise).component; }, 16);
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
          if (sigma_m > kWidest_m) {
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

/// The variance of single readings over that of their mean if errors of the map repeat
/// (docs/design/013-correlated-field-map-error.md). One share serves all components, so that these are comparable.
double PlaceMixture::information_share(const ArrayReading& array, double spacing_m) const {
  const double repeats = correlation_inflation(spacing_m, correlation_m_);
  Eigen::Matrix<double, 3, Eigen::Dynamic> unused;
  double single = 0.0, repeated = 0.0;
  for (const MeanReading& reading : array.readings) {
    const ReadingFit found = fit(reading, components_.front(), input_, background_, unused);
    single += found.variance_ut2();
    repeated += repeats * (found.sensor_variance_ut2 + crowding_ * found.map_variance_ut2);
  }
  return repeated > single ? single / repeated : 1.0;
}

/// A place off the map predicts a field of the map's distribution, no more: that it is off is no evidence against it.
void PlaceMixture::update(const ArrayReading& array, double spacing_m) {
  if (array.readings.empty()) return;
  const double share = information_share(array, spacing_m);
  parallel_for(
      std::size_t{0}, components_.size(),
      [&](std::size_t i) {
        PlaceComponent& component = components_[i];
        Eigen::MatrixXd covariance;  // after the readings so far; weights are by that before
        Eigen::VectorXd step;
        Eigen::Matrix<double, 3, Eigen::Dynamic> H;
        for (const MeanReading& reading : array.readings) {
          const ReadingFit found = fit(reading, component, input_, background_, H);
          const double spread = found.informs ? mean_variance(component.covariance, H) : 0.0;
          const double total = found.variance_ut2() + spread;
          const double squared = found.residual_ut.squaredNorm() / total;
          component.log_weight -=
              share * (1.5 * std::log(total) + 0.5 * (kStudentDegrees + 3.0) * std::log1p(squared / kStudentDegrees));
          if (!found.informs) continue;
          if (step.size() == 0) {
            covariance = component.covariance;
            step.setZero(covariance.cols());
          }
          const double robust = std::max(1.0, (kStudentDegrees + squared) / (kStudentDegrees + 3.0));
          correct<3>(found.residual_ut, H, Matrix3::Identity() * (found.variance_ut2() * robust / share), covariance,
                     step);
        }
        if (step.size() == 0) return;
        make_symmetric(covariance);
        component.covariance = std::move(covariance);
        component.move(step);
      },
      16);
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
    std::vector<PlaceComponent> light(components_.begin() + kept, components_.end());
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
