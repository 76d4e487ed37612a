#include "core/se3.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace posed {
namespace {

constexpr double kPi = static_cast<double>(EIGEN_PI);

class Samples {
 public:
  double uniform(double low, double high) { return low + (high - low) * std::ldexp(static_cast<double>(generator_() >> 11), -53); }
  Eigen::Vector3d vector(double bound) { return {uniform(-bound, bound), uniform(-bound, bound), uniform(-bound, bound)}; }
  Eigen::Vector3d direction() {
    Eigen::Vector3d v = vector(1.0);
    while (v.norm() < 0.1) {
      v = vector(1.0);
    }
    return v.normalized();
  }
  Vector6d tangent(double angle, double metres) {
    Vector6d xi;
    xi << angle * direction(), vector(metres);
    return xi;
  }
  Se3 pose() { return Se3::exp(tangent(uniform(0, kPi), 5.0)); }

 private:
  std::mt19937_64 generator_{20240611};
};

/// The 4x4 matrix exponential by scaling and squaring of its Taylor series: shares no formula with Se3::exp.
Eigen::Matrix4d matrix_exp(const Vector6d& xi) {
  Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
  generator.topLeftCorner<3, 3>() = skew(xi.head<3>());
  generator.topRightCorner<3, 1>() = xi.tail<3>();
  generator /= 256.0;
  Eigen::Matrix4d term = Eigen::Matrix4d::Identity();
  Eigen::Matrix4d sum = term;
  for (int k = 1; k < 12; ++k) {
    term = term * generator / k;
    sum += term;
  }
  for (int k = 0; k < 8; ++k) {
    sum = sum * sum;
  }
  return sum;
}

Eigen::Matrix4d matrix(const Se3& T) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = T.rotation_matrix();
  m.topRightCorner<3, 1>() = T.translation();
  return m;
}

// From nothing to nearly pi, with the switch between series and closed form (1e-4) in the middle.
constexpr double kAngles[] = {
    0.0, 1e-300, 1e-16, 1e-12, 1e-9, 1e-8, 1e-6,       1e-5,       0.99e-4,    1.01e-4,    1e-3,        1e-2,        0.1,
    0.5, 1.0,    2.0,   3.0,   3.1,  3.14, kPi - 1e-3, kPi - 1e-5, kPi - 1e-7, kPi - 1e-9, kPi - 1e-11, kPi - 1e-13, kPi - 1e-15};

TEST(Skew, IsTheCrossProduct) {
  Samples samples;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d a = samples.vector(3);
    const Eigen::Vector3d b = samples.vector(3);
    EXPECT_LT((skew(a) * b - a.cross(b)).norm(), 1e-14);
  }
}

TEST(So3, ExpTurnsByTheAngleAboutTheAxis) {
  const Eigen::Quaterniond q = exp_so3({0, 0, kPi / 2});
  EXPECT_LT((q * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
}

TEST(So3, LogUndoesExpAtEveryAngle) {
  Samples samples;
  for (const double angle : kAngles) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d phi = angle * samples.direction();
      EXPECT_LE((log_so3(exp_so3(phi)) - phi).norm(), 1e-15 + 4e-15 * angle) << "angle " << angle;
    }
  }
}

TEST(So3, LogTakesTheShortWayRound) {
  Samples samples;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Quaterniond q = samples.pose().rotation();
    const Eigen::Quaterniond negative(-q.w(), -q.x(), -q.y(), -q.z());
    EXPECT_LT((log_so3(negative) - log_so3(q)).norm(), 1e-13);
    EXPECT_LE(log_so3(q).norm(), kPi + 1e-15);
  }
  EXPECT_NEAR(log_so3({0, 0, 0, 1}).norm(), kPi, 1e-15);
  EXPECT_NEAR(log_so3({0, 0, 0, -1}).norm(), kPi, 1e-15);
}

TEST(Se3, ExpAgreesWithTheMatrixExponential) {
  Samples samples;
  for (const double angle : kAngles) {
    for (int i = 0; i < 10; ++i) {
      const Vector6d xi = samples.tangent(angle, 2.0);
      EXPECT_LT((matrix(Se3::exp(xi)) - matrix_exp(xi)).norm(), 5e-13) << "angle " << angle;
    }
  }
}

TEST(Se3, LogUndoesExpAtEveryAngle) {
  Samples samples;
  for (const double angle : kAngles) {
    for (int i = 0; i < 20; ++i) {
      const Vector6d xi = samples.tangent(angle, 2.0);
      EXPECT_LT((Se3::exp(xi).log() - xi).norm(), 1e-13) << "angle " << angle;
    }
  }
}

TEST(Se3, ExpUndoesLogForRandomPoses) {
  Samples samples;
  for (int i = 0; i < 1000; ++i) {
    const Se3 T = samples.pose();
    EXPECT_LT((matrix(Se3::exp(T.log())) - matrix(T)).norm(), 1e-13);
  }
}

TEST(Se3, InverseAndCompositionAreThoseOfMatrices) {
  Samples samples;
  for (int i = 0; i < 100; ++i) {
    const Se3 a = samples.pose();
    const Se3 b = samples.pose();
    const Eigen::Vector3d p = samples.vector(3);
    EXPECT_LT((matrix(a * b) - matrix(a) * matrix(b)).norm(), 1e-13);
    EXPECT_LT((matrix(a * a.inverse()) - Eigen::Matrix4d::Identity()).norm(), 1e-13);
    EXPECT_LT((a * (b * p) - (a * b) * p).norm(), 1e-13);
    EXPECT_LT((a * p - (matrix(a) * p.homogeneous()).head<3>()).norm(), 1e-13);
  }
}

TEST(Se3, AdjointMovesATangentToTheLeft) {
  Samples samples;
  for (int i = 0; i < 100; ++i) {
    const Se3 T = samples.pose();
    const Vector6d xi = samples.tangent(samples.uniform(0, 3), 2.0);
    EXPECT_LT((matrix(T * Se3::exp(xi)) - matrix(Se3::exp(T.adjoint() * xi) * T)).norm(), 1e-12);
  }
}

TEST(Se3, StaysARotationThroughLongChains) {
  Samples samples;
  Se3 T;
  for (int i = 0; i < 100'000; ++i) {
    T = T * Se3::exp(samples.tangent(0.1, 0.1));
  }
  EXPECT_NEAR(T.rotation().norm(), 1.0, 1e-15);
}

TEST(Se3, NormalisesTheRotationItIsGiven) {
  const Se3 T(Eigen::Quaterniond(2, 0, 0, 0), Eigen::Vector3d::Zero());
  EXPECT_DOUBLE_EQ(T.rotation().w(), 1.0);
}

TEST(Se3, NoticesValuesThatAreNotNumbers) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(Se3().is_finite());
  EXPECT_FALSE(Se3(Eigen::Quaterniond::Identity(), {0, kNan, 0}).is_finite());
  EXPECT_FALSE(Se3(Eigen::Quaterniond::Identity(), {0, 0, kInfinity}).is_finite());
  EXPECT_FALSE(Se3(Eigen::Quaterniond(kNan, 0, 0, 1), Eigen::Vector3d::Zero()).is_finite());
}

}  // namespace
}  // namespace posed
