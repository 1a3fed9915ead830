#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "core/lidar/condensed_cost.h"
#include "core/lidar/plane_map.h"
#include "core/lidar/square_root.h"

namespace lodestone {
namespace {

struct Scene {
  std::vector<Plane> planes;
  std::vector<Correspondence> matches;
  Pose pose;
};

Scene random_scene(std::uint64_t seed, int count, double distance_from_origin_m) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Vector3(normal(generator), normal(generator), normal(generator)); };
  Scene scene;
  scene.pose = {so3::exp(draw()), distance_from_origin_m * Vector3(0.8, -0.6, 0.1) + draw()};
  scene.planes.resize(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    Plane& plane = scene.planes[static_cast<std::size_t>(i)];
    plane = {};
    const Vector3 point = 10.0 * draw();
    plane.normal = draw().normalized().cast<float>();
    plane.major = Eigen::Vector3f(plane.normal.unitOrthogonal());
    plane.center = (scene.pose * point + 0.05 * draw()).cast<float>();
    plane.major_tilt_variance = plane.minor_tilt_variance = 1e-4F;
    scene.matches.push_back(
        {point.cast<float>(), &plane, 4e-4F, static_cast<float>(0.2 + 0.8 * std::abs(std::sin(i)))});
  }
  return scene;
}

TEST(CondensedCost, EqualsOneResidualAPointAwayFromWhereItWasAccumulated) {
  for (double far : {0.0, 100.0, 2000.0}) {
    const Scene scene = random_scene(1, 3000, far);
    const CondensedCost condensed = condense(scene.matches, scene.pose);
    for (double away : {0.0, 0.01, 0.3}) {
      Vector6 step;
      step << 0.2, -0.1, 0.3, 1.0, -2.0, 0.5;
      const Pose pose = scene.pose.boxplus(away * step);
      double cost = 0.0;
      Vector6 gradient = Vector6::Zero();
      Matrix6 hessian = Matrix6::Zero();
      for (const Correspondence& match : scene.matches) {
        const Vector3 n = match.plane->normal.cast<double>();
        const Vector3 p = match.point.cast<double>();
        const double residual = n.dot(pose * p - match.plane->center.cast<double>());
        Vector6 jacobian;
        jacobian.head<3>() = p.cross(pose.rotation.conjugate() * n);
        jacobian.tail<3>() = n;
        const double weight = static_cast<double>(match.weight());
        cost += weight * residual * residual;
        gradient += weight * residual * jacobian;
        hessian += weight * jacobian * jacobian.transpose();
      }
      EXPECT_NEAR(condensed.cost(pose) / cost, 1.0, 1e-9) << far << " " << away;
      EXPECT_LT((condensed.gradient(pose) - gradient).norm(), 1e-9 * gradient.norm());
      EXPECT_LT((condensed.hessian(pose) - hessian).norm(), 1e-9 * hessian.norm());
      const Vector13 root = square_root(condensed.moment) * condensed.coordinates(pose);
      EXPECT_NEAR(root.squaredNorm() / cost, 1.0, 1e-9) << far << " " << away;
    }
  }
}

TEST(CondensedCost, SquareRootStandsForSingularGeometry) {
  Scene scene = random_scene(2, 500, 50.0);
  for (Plane& plane : scene.planes) plane.normal = Eigen::Vector3f(0, 0, 1);
  const CondensedCost condensed = condense(scene.matches, scene.pose);
  const Matrix13 root = square_root(condensed.moment);
  EXPECT_TRUE(root.allFinite());
  EXPECT_LT((root.transpose() * root - condensed.moment).norm(), 1e-12 * condensed.moment.norm());
}

TEST(CondensedCost, SpuriousInformationIsWhatNoiseOfTheNormalsAdds) {
  Scene scene = random_scene(3, 4000, 0.0);
  scene.pose.rotation.setIdentity();
  for (Plane& plane : scene.planes) {
    plane.normal = Eigen::Vector3f(0, 0, 1);
    plane.major = Eigen::Vector3f(1, 0, 0);
  }
  const Matrix6 clean = condense(scene.matches, scene.pose).hessian(scene.pose);
  const Matrix6 predicted = condense(scene.matches, scene.pose).spurious_information;
  std::mt19937_64 generator(4);
  std::normal_distribution<float> normal(0.0F, 1e-2F);
  Matrix6 mean = Matrix6::Zero();
  for (int run = 0; run < 50; ++run) {
    Scene noisy = scene;
    for (std::size_t i = 0; i < noisy.planes.size(); ++i) {
      noisy.planes[i].normal = Eigen::Vector3f(normal(generator), normal(generator), 1.0F);
      noisy.matches[i].plane = &noisy.planes[i];
    }
    mean += condense(noisy.matches, noisy.pose).hessian(noisy.pose) / 50.0;
  }
  const Matrix6 added = mean - clean;
  // A level plane does not constrain yaw, x and y: all information there is due to noise.
  for (int i : {2, 3, 4}) {
    EXPECT_LT(clean(i, i), 1e-9 * clean(5, 5));
    EXPECT_NEAR(added(i, i) / predicted(i, i), 1.0, 0.05) << i;
  }
}

TEST(PlaneMap, FindsThePlanesOfABoxAndMarksItsEdges) {
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<float> uniform(0.0F, 10.0F);
  std::normal_distribution<float> noise(0.0F, 0.005F);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 240000; ++i) {
    Eigen::Vector3f point(uniform(generator), uniform(generator), uniform(generator));
    const int face = i % 6;
    point[face / 2] = (face % 2 == 0 ? 0.1F : 9.9F) + noise(generator);
    points.push_back(point);
  }
  const PlaneMap map(points, PlaneMapOptions{});
  EXPECT_GT(map.planes().size(), 6000U);
  int matched = 0;
  int tested = 0;
  for (int i = 0; i < 6000; ++i) {
    const int axis = (i % 6) / 2;
    const Eigen::Vector3f point = points[static_cast<std::size_t>(i)];
    bool near_edge = false;
    for (int k = 0; k < 3; ++k) near_edge |= k != axis && (point[k] < 1.0F || point[k] > 9.0F);
    if (near_edge) continue;
    ++tested;
    const Plane* plane = map.match(point, 0.1F);
    if (plane == nullptr) continue;
    // A matched plane is the face that the point lies on.
    EXPECT_GT(std::abs(plane->normal[axis]), 0.99F);
    if (std::abs(plane->normal[axis]) > 0.99F && std::abs(plane->distance(point)) < 0.05F) ++matched;
  }
  // A voxel with more than 1.3 times the median's noise is rejected: at some fifty points, one in a thousand.
  EXPECT_GT(matched, 0.99 * tested);
  EXPECT_EQ(map.match(Eigen::Vector3f(5, 5, 5), 0.3F), nullptr);
}

TEST(PlaneMap, ManyPointsAtOnceGetThePlanesOfSinglePoints) {
  std::mt19937_64 generator(8);
  std::uniform_real_distribution<float> uniform(0.0F, 6.0F);
  std::normal_distribution<float> noise(0.0F, 0.01F);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 60000; ++i) {
    Eigen::Vector3f point(uniform(generator), uniform(generator), uniform(generator));
    point[i % 3] = (i % 2 == 0 ? 1.0F : 4.9F) + noise(generator);
    points.push_back(point);
  }
  const PlaneMap map(points, PlaneMapOptions{});
  std::vector<Eigen::Vector3f> wanted;
  for (int i = 0; i < 5003; ++i) {
    wanted.emplace_back(uniform(generator), uniform(generator), uniform(generator));
    if (i % 2 == 0) wanted.back()[i % 3] = 1.0F + 5.0F * noise(generator);
  }
  std::vector<const Plane*> planes(wanted.size());
  map.match(wanted, 0.1F, planes);
  std::size_t found = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_EQ(planes[i], map.match(wanted[i], 0.1F)) << wanted[i].transpose();
    found += planes[i] != nullptr ? 1 : 0;
  }
  EXPECT_GT(found, wanted.size() / 4);
  EXPECT_LT(found, 3 * wanted.size() / 4);
}

TEST(PlaneMap, APointJustOverAVoxelsEdgeLosesNothing) {
  // The surface lies a millimetre below a voxel's face: noise puts half of a scan's points into the empty voxel above.
  std::mt19937_64 generator(6);
  std::uniform_real_distribution<float> uniform(0.0F, 5.0F);
  std::vector<Eigen::Vector3f> points;
  points.reserve(10000);
  for (int i = 0; i < 10000; ++i) points.emplace_back(uniform(generator), uniform(generator), 0.999F);
  const PlaneMap map(points, PlaneMapOptions{});
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3f above(0.3F + 0.9F * uniform(generator) * 0.9F, 0.3F + 0.8F * uniform(generator), 1.02F);
    EXPECT_NE(map.match(above, 0.1F), nullptr) << above.transpose();
  }
}

TEST(PlaneFit, VarianceOfTheFitIsThatOfRepeatedFits) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> uniform(-0.25, 0.25);
  std::normal_distribution<double> noise(0.0, 0.01);
  double squared_error = 0.0;
  double predicted = 0.0;
  const Eigen::Vector3f place(0.2F, -0.2F, 0.0F);
  for (int run = 0; run < 3000; ++run) {
    PointMoments moments;
    for (int i = 0; i < 25; ++i) moments.add(Vector3(uniform(generator), uniform(generator), noise(generator)));
    Plane plane;
    ASSERT_TRUE(fit_plane(moments, Vector3::Zero(), PlaneFitOptions{}, plane));
    squared_error += std::pow(plane.distance(place), 2);
    predicted += plane.variance_at(place);
  }
  EXPECT_NEAR(squared_error / predicted, 1.0, 0.1);
}

TEST(PlaneFit, RefusesLinesVolumesAndTooFewPoints) {
  std::mt19937_64 generator(8);
  std::uniform_real_distribution<double> uniform(-0.25, 0.25);
  PointMoments line;
  PointMoments volume;
  PointMoments few;
  for (int i = 0; i < 100; ++i) {
    line.add(Vector3(uniform(generator), 0.01 * uniform(generator), 0.01 * uniform(generator)));
    volume.add(Vector3(uniform(generator), uniform(generator), uniform(generator)));
    if (i < 3) few.add(Vector3(uniform(generator), uniform(generator), 0.0));
  }
  Plane plane;
  EXPECT_FALSE(fit_plane(line, Vector3::Zero(), PlaneFitOptions{}, plane));
  EXPECT_FALSE(fit_plane(volume, Vector3::Zero(), PlaneFitOptions{}, plane));
  EXPECT_FALSE(fit_plane(few, Vector3::Zero(), PlaneFitOptions{}, plane));
}

}  // namespace
}  // namespace lodestone
