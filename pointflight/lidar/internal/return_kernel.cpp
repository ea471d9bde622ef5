// Detection and range noise in lanes.
#include "pointflight/lidar/internal/return_kernel.hpp"

#include <limits>

#include "pointflight/core/internal/simd_targets-inl.hpp"
// for foreach_target
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pointflight/lidar/internal/return_kernel.cpp"
#include <hwy/foreach_target.h>
// after foreach_target
#include "pointflight/core/internal/math_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace pointflight::HWY_NAMESPACE {

/// `on_line`
HWY_INLINE DoubleLanes line_lanes(std::span<const double> xs,
                                  std::span<const double> ys,
                                  DoubleLanes x) {
  DoubleLanes x0 = hn::Set(kD, xs[0]);
  DoubleLanes y0 = hn::Set(kD, ys[0]);
  DoubleLanes dx = hn::Set(kD, xs[1] - xs[0]);
  DoubleLanes dy = hn::Set(kD, ys[1] - ys[0]);
  for (std::size_t i = 1; i + 1 < xs.size(); ++i) {
    const auto beyond = hn::Ge(x, hn::Set(kD, xs[i]));
    x0 = hn::IfThenElse(beyond, hn::Set(kD, xs[i]), x0);
    y0 = hn::IfThenElse(beyond, hn::Set(kD, ys[i]), y0);
    dx = hn::IfThenElse(beyond, hn::Set(kD, xs[i + 1] - xs[i]), dx);
    dy = hn::IfThenElse(beyond, hn::Set(kD, ys[i + 1] - ys[i]), dy);
  }
  return hn::Add(y0, hn::Div(hn::Mul(dy, hn::Sub(x, x0)), dx));
}

/// `DetectionModel::near_gain`
HWY_INLINE DoubleLanes near_gain_lanes(const SignalFigures& f, DoubleLanes range) {
  const DoubleLanes all = hn::Set(kD, 1.0);
  if (f.near_ranges.empty()) return all;
  const auto is_near = hn::Lt(range, hn::Set(kD, f.near_ranges.back()));
  if (hn::AllFalse(kD, is_near)) return all;
  DoubleLanes gain = hn::Set(kD, f.near_shares.front());
  if (f.near_ranges.size() > 1) {
    const auto is_nearest = hn::Le(range, hn::Set(kD, f.near_ranges.front()));
    gain = hn::IfThenElse(is_nearest, gain, line_lanes(f.near_ranges, f.near_shares, range));
  }
  return hn::IfThenElse(is_near, gain, all);
}

/// `DetectionModel::margin`
HWY_INLINE DoubleLanes margin_lanes(const SignalFigures& f,
                                    DoubleLanes reflectivity,
                                    DoubleLanes range) {
  const DoubleLanes rated =
      exp_lanes(line_lanes(f.log_ranges, f.log_reflectivities, log_lanes(range)));
  return hn::Div(hn::Mul(reflectivity, near_gain_lanes(f, range)), rated);
}

/// `DetectionModel::probability`
HWY_INLINE DoubleLanes probability_lanes(const SignalFigures& f, DoubleLanes margin) {
  constexpr double kCertain = 9.0;  // Phi(9) = 1 - 1e-19: one in doubles
  const DoubleLanes x = hn::Sub(hn::Mul(hn::Set(kD, f.slope), margin), hn::Set(kD, f.threshold));
  if (hn::AllTrue(kD, hn::Ge(x, hn::Set(kD, kCertain)))) return hn::Set(kD, 1.0);
  return normal_probability_lanes(x);
}

/// `ReturnModel::range_sigma`
HWY_INLINE DoubleLanes sigma_lanes(const SignalFigures& f, DoubleLanes range, DoubleLanes margin) {
  const DoubleLanes sigma = hn::Set(kD, f.range_sigma);
  const DoubleLanes far = hn::Mul(hn::Mul(hn::Set(kD, f.range_sigma_per_m2), range), range);
  const DoubleLanes weak = hn::Div(hn::Set(kD, f.range_sigma_at_limit), margin);
  return hn::Sqrt(hn::Add(hn::Add(hn::Mul(sigma, sigma), hn::Mul(far, far)), hn::Mul(weak, weak)));
}

static void measure_block(const SignalFigures& f, SignalBlock& block) {
  const hn::Rebind<float, DoubleTag> floats;
  const DoubleLanes half = hn::Set(kD, 0.5);
  const DoubleLanes step = hn::Set(kD, f.range_step);
  for (std::size_t i = block.count; i % kDoubles != 0; ++i) {  // what the last lanes compute
    block.range[i] = block.reflectivity[i] = 1.0;
    block.normal[i] = block.detection[i] = 0.0;
  }
  for (std::size_t i = 0; i < block.count; i += kDoubles) {
    const DoubleLanes range = hn::Load(kD, block.range.data() + i);
    const DoubleLanes nearest = hn::Set(kD, kNearestSignal);
    DoubleLanes margin = hn::Set(kD, std::numeric_limits<double>::infinity());
    DoubleLanes probability = hn::Set(kD, 2.0);  // of no draw
    if (!f.log_ranges.empty()) {
      const DoubleLanes reflectivity = hn::Load(kD, block.reflectivity.data() + i);
      margin = margin_lanes(f, reflectivity, hn::Max(range, nearest));
      probability = probability_lanes(f, margin);
    }
    const DoubleLanes noise =
        hn::Mul(sigma_lanes(f, range, margin), hn::Load(kD, block.normal.data() + i));
    DoubleLanes measured = hn::Add(range, noise);
    if (f.range_step > 0.0) {
      measured = hn::Mul(step, hn::Floor(hn::Add(hn::Div(measured, step), half)));
    }
    const auto is_seen = hn::Lt(hn::Load(kD, block.detection.data() + i), probability);
    measured = hn::IfThenElse(is_seen, measured, hn::Set(kD, -1.0));
    hn::Store(hn::DemoteTo(floats, measured), floats, block.measured.data() + i);
  }
}

}  // namespace pointflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pointflight {
namespace {

HWY_EXPORT(measure_block);

}  // namespace

void measure_signals(const SignalFigures& figures, SignalBlock& block) {
  HWY_DYNAMIC_DISPATCH(measure_block)(figures, block);
}

}  // namespace pointflight
#endif  // HWY_ONCE
