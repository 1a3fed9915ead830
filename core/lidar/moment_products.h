#pragma once

#include <array>

#include "core/geometry/pose.h"

namespace lodestone {

/// Σ w a aᵀ of point-to-plane rows a = [p ⊗ n; n; d] ∈ R¹³, as its unique products: (w n nᵀ) ⊗ (p̃ p̃ᵀ) with p̃ = [p;
/// 1], and a border for the plane's offset d. 6 × 10 + 12 + 1 numbers instead of 169.
struct MomentProducts {
  std::array<double, 60> products{};  ///< upper n nᵀ (6) by upper p̃ p̃ᵀ (10)
  std::array<double, 12> border{};    ///< w n d ⊗ p̃
  double offset_squared = 0.0;

  /// `n`: normal, map axes. `p`: point about the scan's centroid, imu frame, m. `d`: n · (anchor − plane's centre), m.
  void add(const Vector3& n, const Vector3& p, double d, double w) {
    const std::array<double, 6> nn{w * n.x() * n.x(), w * n.x() * n.y(), w * n.x() * n.z(),
                                   w * n.y() * n.y(), w * n.y() * n.z(), w * n.z() * n.z()};
    const std::array<double, 10> pp{p.x() * p.x(), p.x() * p.y(), p.x() * p.z(), p.x(), p.y() * p.y(),
                                    p.y() * p.z(), p.y(),         p.z() * p.z(), p.z(), 1.0};
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < 10; ++b) products[static_cast<std::size_t>(10 * a + b)] += nn[a] * pp[b];
    }
    const std::array<double, 3> nd{w * d * n.x(), w * d * n.y(), w * d * n.z()};
    const std::array<double, 4> one{p.x(), p.y(), p.z(), 1.0};
    for (int b = 0; b < 4; ++b) {
      for (int a = 0; a < 3; ++a) border[static_cast<std::size_t>(3 * b + a)] += nd[a] * one[b];
    }
    offset_squared += w * d * d;
  }

  MomentProducts& operator+=(const MomentProducts& other) {
    for (std::size_t i = 0; i < products.size(); ++i) products[i] += other.products[i];
    for (std::size_t i = 0; i < border.size(); ++i) border[i] += other.border[i];
    offset_squared += other.offset_squared;
    return *this;
  }

  Eigen::Matrix<double, 13, 13> moment() const {
    static constexpr int kNormal[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    static constexpr int kPoint[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};
    Eigen::Matrix<double, 13, 13> result;
    for (int b = 0; b < 4; ++b) {
      for (int d = 0; d < 4; ++d) {
        for (int a = 0; a < 3; ++a) {
          for (int c = 0; c < 3; ++c) {
            result(3 * b + a, 3 * d + c) = products[static_cast<std::size_t>(10 * kNormal[a][c] + kPoint[b][d])];
          }
        }
      }
    }
    for (int i = 0; i < 12; ++i) result(i, 12) = result(12, i) = border[static_cast<std::size_t>(i)];
    result(12, 12) = offset_squared;
    return result;
  }
};

}  // namespace lodestone
