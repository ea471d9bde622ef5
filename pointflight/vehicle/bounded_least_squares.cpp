#include "pointflight/vehicle/bounded_least_squares.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

namespace pointflight {
namespace {

constexpr double kRounding = 1e-9;

enum class Side { kFree, kLow, kHigh };

}  // namespace

Eigen::VectorXd bounded_least_squares(const Eigen::MatrixXd& A,
                                      const Eigen::VectorXd& b,
                                      const Eigen::VectorXd& low,
                                      const Eigen::VectorXd& high) {
  const Eigen::Index n = A.cols();
  Eigen::VectorXd x = 0.5 * (low + high);
  std::vector<Side> sides(static_cast<std::size_t>(n), Side::kFree);
  const auto side = [&](Eigen::Index i) -> Side& { return sides[static_cast<std::size_t>(i)]; };
  for (Eigen::Index i = 0; i < n; ++i) {
    if (high[i] - low[i] < kRounding) side(i) = Side::kLow;
  }
  const Eigen::Index most = 4 * n + 10;  // it ends long before; rounding might make it circle
  for (Eigen::Index round = 0; round < most; ++round) {
    // the best step of those that are free
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (side(i) == Side::kFree) free.push_back(i);
    }
    const Eigen::VectorXd rest = b - A * x;
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    if (!free.empty()) {
      const Eigen::MatrixXd part = A(Eigen::all, free);
      const Eigen::VectorXd best = (part.transpose() * part).ldlt().solve(part.transpose() * rest);
      for (std::size_t k = 0; k < free.size(); ++k) {
        step[free[k]] = best[static_cast<Eigen::Index>(k)];
      }
    }
    // as far as the first bound
    double share = 1.0;
    Eigen::Index blocks = -1;
    for (const Eigen::Index i : free) {
      const double room = step[i] > 0.0 ? high[i] - x[i] : low[i] - x[i];
      if (std::abs(step[i]) <= kRounding || share * std::abs(step[i]) <= std::abs(room)) continue;
      share = room / step[i];
      blocks = i;
    }
    x += std::max(share, 0.0) * step;
    if (blocks >= 0) {
      side(blocks) = step[blocks] > 0.0 ? Side::kHigh : Side::kLow;
      continue;
    }
    // does a bound hold one back that would rather leave it?
    const Eigen::VectorXd pull = A.transpose() * (b - A * x);
    double worst = -kRounding;
    Eigen::Index leaves = -1;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (side(i) == Side::kFree || high[i] - low[i] < kRounding) continue;
      const double kept = side(i) == Side::kHigh ? pull[i] : -pull[i];
      if (kept >= worst) continue;
      worst = kept;
      leaves = i;
    }
    if (leaves < 0) break;
    side(leaves) = Side::kFree;
  }
  return x.cwiseMax(low).cwiseMin(high);
}

}  // namespace pointflight
