#pragma once

#include "core/geometry/so3.h"
#include "core/lidar/bent_map.h"
#include "core/lidar/displacement_part.h"

namespace lodestone {

/// Covariance of the least squares of a scan by displacements of cubes of a variance of one square metre. Order φ (map
/// axes), p. Source: docs/design/042-repeated-map-error.md.
inline Matrix6 cube_covariance_of(const MapError& error) {
  Matrix6 result = Matrix6::Zero();
  for (const PlaceOffset& cube : error.cubes) {
    const Matrix6x3 moved = error.inverse * cube.coupling;
    result += moved * moved.transpose();
  }
  return 0.5 * (result + result.transpose());
}

/// Error of the least squares of a scan by the smooth parts: the pose minus the place in the displaced map. The place
/// moves by the displacement with ℓ = 20 m and more, and its axes rotate by half the curl. Source: as above.
inline LongMapError long_error_of(const MapError& error, const MapErrorVariances& variances_m2) {
  const std::vector<PlaceOffset>& places = error.cubes.size() <= kManyCubes ? error.cubes : error.cells;
  std::vector<Matrix6x3> moved;
  moved.reserve(places.size());
  for (const PlaceOffset& place : places) moved.push_back(error.inverse * place.coupling);
  std::array<Matrix6, kMapErrorParts> covariances;
  covariances.fill(Matrix6::Zero());
  for (int part = 1; part < kMapErrorParts; ++part) {
    if (!(variances_m2[part] > 0.0) || places.empty()) continue;
    const double length_m = map_error_length_m(part);
    Matrix6& covariance = covariances[static_cast<std::size_t>(part)];
    for (std::size_t i = 0; i < places.size(); ++i) {
      Matrix6x3 sum = 0.5 * moved[i];  // each pair once
      for (std::size_t j = 0; j < i; ++j) {
        const double correlation = map_error_correlation((places[i].center - places[j].center).squaredNorm(), part);
        if (correlation > 0.0) sum += correlation * moved[j];
      }
      if (part >= kFirstPartOfPlaces) {
        const Vector3 away = places[i].center - error.position;
        const double correlation = map_error_correlation(away.squaredNorm(), part);
        Matrix6x3 place;
        place.topRows<3>() = 0.5 * correlation / (length_m * length_m) * so3::hat(away);
        place.bottomRows<3>() = correlation * Matrix3::Identity();
        sum -= place;
      }
      const Matrix6 product = moved[i] * sum.transpose();
      covariance += product + product.transpose();
    }
    if (part >= kFirstPartOfPlaces) {
      covariance.diagonal().head<3>().array() += 0.5 / (length_m * length_m);
      covariance.diagonal().tail<3>().array() += 1.0;
    }
    covariance *= variances_m2[part];
  }
  return sum_of_parts(covariances);
}

}  // namespace lodestone
