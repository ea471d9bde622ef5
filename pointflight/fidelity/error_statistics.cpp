#include "pointflight/fidelity/error_statistics.hpp"

#include <algorithm>
#include <cmath>

namespace pointflight {

void ErrorCollector::add(double true_range, const std::optional<double>& rendered) {
  ++rays_;
  if (!rendered) {
    ++missing_;
    return;
  }
  const double error = *rendered - true_range;
  if (error < -ErrorStatistics::kRight) {
    ++early_;
  } else if (error > ErrorStatistics::kRight) {
    ++late_;
  } else {
    errors_.push_back(static_cast<float>(error));
  }
}

void ErrorCollector::add_empty(bool has_return) {
  ++rays_;
  false_ += has_return ? 1 : 0;
}

void ErrorCollector::add(const ErrorCollector& other) {
  rays_ += other.rays_;
  missing_ += other.missing_;
  early_ += other.early_;
  late_ += other.late_;
  false_ += other.false_;
  errors_.insert(errors_.end(), other.errors_.begin(), other.errors_.end());
}

ErrorStatistics ErrorCollector::statistics() const {
  ErrorStatistics s;
  s.rays = rays_;
  if (rays_ == 0) return s;
  const auto share = [&](std::uint64_t count) {
    return static_cast<double>(count) / static_cast<double>(rays_);
  };
  s.missing_fraction = share(missing_);
  s.early_fraction = share(early_);
  s.late_fraction = share(late_);
  s.false_fraction = share(false_);
  s.wrong_fraction = share(early_ + late_);
  if (errors_.empty()) return s;
  double sum = 0.0;
  std::vector<float> sizes;
  sizes.reserve(errors_.size());
  for (const float error : errors_) {
    sum += static_cast<double>(error);
    sizes.push_back(std::abs(error));
  }
  std::sort(sizes.begin(), sizes.end());
  const auto at = [&](double part) {
    const auto last = static_cast<double>(sizes.size() - 1);
    return static_cast<double>(sizes[static_cast<std::size_t>(part * last)]);
  };
  s.median_abs_error = at(0.5);
  s.p90_abs_error = at(0.9);
  s.p95_abs_error = at(0.95);
  s.bias = sum / static_cast<double>(errors_.size());
  return s;
}

}  // namespace pointflight
