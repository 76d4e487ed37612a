#pragma once

#include <algorithm>
#include <cmath>

namespace posed {

/// The damping of Levenberg-Marquardt, steered by the ratio of actual to predicted decrease (Madsen, Nielsen, Tingleff, "Methods
/// for non-linear least squares problems", 2004, equation 2.21). It multiplies the diagonal. Reentrant.
class MarquardtDamping {
 public:
  double value() const { return value_; }
  bool is_exhausted() const { return value_ > kGreatest; }

  /// What it adds to the diagonal of a Hessian or of a block of one. A direction that nothing observes needs a least diagonal.
  template <typename Hessian>
  static auto terms(const Hessian& hessian, double damping) {
    constexpr double kLeastDiagonal = 1e-6;
    return (damping * hessian.diagonal().array().max(kLeastDiagonal)).matrix();
  }

  void accepted(double gain_ratio) {
    value_ = std::max(kLeast, value_ * std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain_ratio - 1.0, 3)));
    growth_ = 2.0;
  }
  void refused() {
    value_ *= growth_;
    growth_ *= 2.0;
  }

 private:
  static constexpr double kInitial = 1e-4;
  static constexpr double kLeast = 1e-9;
  static constexpr double kGreatest = 1e8;

  double value_ = kInitial;
  double growth_ = 2.0;
};

}  // namespace posed
