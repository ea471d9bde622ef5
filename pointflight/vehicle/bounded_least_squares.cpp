#include "pointflight/vehicle/bounded_least_squares.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace pointflight {
namespace {

constexpr double kRounding = 1e-9;

/// The search: which unknowns are free, which lie at a bound.
class ActiveSet {
 public:
  ActiveSet(const Eigen::MatrixXd& A,
            const Eigen::VectorXd& b,
            const Eigen::VectorXd& low,
            const Eigen::VectorXd& high)
      : a_(A),
        b_(b),
        low_(low),
        high_(high),
        x_(0.5 * (low + high)),
        sides_(static_cast<std::size_t>(A.cols()), Side::kFree) {
    for (Eigen::Index i = 0; i < x_.size(); ++i) {
      if (is_fixed(i)) side(i) = Side::kLow;
    }
  }

  /// One round; false if nothing gets better.
  bool improve() {
    const Eigen::VectorXd step = best_step();
    const Eigen::Index blocks = go(step);
    if (blocks >= 0) {
      side(blocks) = step[blocks] > 0.0 ? Side::kHigh : Side::kLow;
      return true;
    }
    return release();
  }

  [[nodiscard]] Eigen::VectorXd x() const { return x_.cwiseMax(low_).cwiseMin(high_); }

 private:
  enum class Side { kFree, kLow, kHigh };

  [[nodiscard]] Side& side(Eigen::Index i) { return sides_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] bool is_fixed(Eigen::Index i) const { return high_[i] - low_[i] < kRounding; }

  /// Of those that are free, without looking at bounds.
  [[nodiscard]] Eigen::VectorXd best_step() {
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < x_.size(); ++i) {
      if (side(i) == Side::kFree) free.push_back(i);
    }
    Eigen::VectorXd step = Eigen::VectorXd::Zero(x_.size());
    if (free.empty()) return step;
    const Eigen::MatrixXd part = a_(Eigen::all, free);
    const Eigen::VectorXd rest = part.transpose() * (b_ - a_ * x_);
    const Eigen::VectorXd best = (part.transpose() * part).ldlt().solve(rest);
    for (std::size_t k = 0; k < free.size(); ++k) {
      step[free[k]] = best[static_cast<Eigen::Index>(k)];
    }
    return step;
  }

  /// Goes as far as the first bound and returns whose that is; -1: all the way.
  Eigen::Index go(const Eigen::VectorXd& step) {
    double share = 1.0;
    Eigen::Index blocks = -1;
    for (Eigen::Index i = 0; i < x_.size(); ++i) {
      const double room = step[i] > 0.0 ? high_[i] - x_[i] : low_[i] - x_[i];
      if (std::abs(step[i]) <= kRounding || share * std::abs(step[i]) <= std::abs(room)) continue;
      share = room / step[i];
      blocks = i;
    }
    x_ += std::max(share, 0.0) * step;
    return blocks;
  }

  /// Frees the one that its bound holds back most from doing better; false if there is none.
  bool release() {
    const Eigen::VectorXd pull = a_.transpose() * (b_ - a_ * x_);
    double worst = -kRounding;
    Eigen::Index leaves = -1;
    for (Eigen::Index i = 0; i < x_.size(); ++i) {
      if (side(i) == Side::kFree || is_fixed(i)) continue;
      const double kept = side(i) == Side::kHigh ? pull[i] : -pull[i];
      if (kept >= worst) continue;
      worst = kept;
      leaves = i;
    }
    if (leaves >= 0) side(leaves) = Side::kFree;
    return leaves >= 0;
  }

  const Eigen::MatrixXd& a_;
  const Eigen::VectorXd& b_;
  const Eigen::VectorXd& low_;
  const Eigen::VectorXd& high_;
  Eigen::VectorXd x_;
  std::vector<Side> sides_;
};

}  // namespace

Eigen::VectorXd bounded_least_squares(const Eigen::MatrixXd& A,
                                      const Eigen::VectorXd& b,
                                      const Eigen::VectorXd& low,
                                      const Eigen::VectorXd& high) {
  ActiveSet search(A, b, low, high);
  // it ends long before; rounding might make it circle
  for (Eigen::Index rounds = 4 * A.cols() + 10; rounds > 0 && search.improve(); --rounds) {
  }
  return search.x();
}

}  // namespace pointflight
