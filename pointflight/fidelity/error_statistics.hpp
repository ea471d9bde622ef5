#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace pointflight {

/// How rendered ranges lie beside true or measured ones.
///
/// A ray is *right* within 0.1 m, else *early* (rendered nearer) or *late*; *missing* if nothing
/// was rendered. Shares are of all rays; median, percentiles and bias are over the right ones, so
/// that a few wrong surfaces do not hide how exact the others are.
struct ErrorStatistics {
  std::uint64_t rays = 0;         ///< Those that hit nothing in truth included.
  double median_abs_error = 0.0;  ///< m
  double p90_abs_error = 0.0;     ///< m
  double p95_abs_error = 0.0;     ///< m
  double bias = 0.0;              ///< Mean of rendered minus true, m.
  double missing_fraction = 0.0;  ///< Shares of all rays, 0 to 1.
  double early_fraction = 0.0;    ///< Share, rendered nearer by more than kRight.
  double late_fraction = 0.0;     ///< Share, rendered farther by more than kRight.
  double wrong_fraction = 0.0;    ///< Early and late.
  double false_fraction = 0.0;    ///< Returns of rays that hit nothing in truth.

  /// Late or missed: rays that came through a surface.
  [[nodiscard]] double leak_fraction() const { return late_fraction + missing_fraction; }

  static constexpr double kRight = 0.1;  ///< m
};

/// Collects rays for `ErrorStatistics`.
class ErrorCollector {
 public:
  /// `rendered` is nothing if there was no return.
  void add(double true_range, const std::optional<double>& rendered);
  /// A ray that hits nothing in truth.
  void add_empty(bool has_return);
  /// All rays of another collector.
  void add(const ErrorCollector& other);
  /// Of what was added so far; all zero without rays.
  [[nodiscard]] ErrorStatistics statistics() const;

 private:
  std::uint64_t rays_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t early_ = 0;
  std::uint64_t late_ = 0;
  std::uint64_t false_ = 0;
  std::vector<float> errors_;  ///< Of the right rays, m.
};

}  // namespace pointflight
