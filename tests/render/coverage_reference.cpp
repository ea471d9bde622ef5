#include "tests/render/coverage_reference.hpp"

#include <algorithm>

namespace pointflight {
namespace {

bool before(const SurfelHit& a, const SurfelHit& b) {
  if (a.t != b.t) return a.t < b.t;
  if (a.word != b.word) return a.word < b.word;
  return a.index < b.index;
}

}  // namespace

void HitList::sort() {
  if (sorted_) return;
  // a handful of hits, most of them already in order
  for (std::size_t i = 1; i < size_; ++i) {
    const SurfelHit hit = hits_[i];
    std::size_t j = i;
    for (; j > 0 && before(hit, hits_[j - 1]); --j) hits_[j] = hits_[j - 1];
    hits_[j] = hit;
  }
  sorted_ = true;
}

void HitList::drop_behind(float t) {
  sort();
  while (size_ > 0 && hits_[size_ - 1].t > t) --size_;
  total_ = 0.0f;
  for (std::size_t i = 0; i < size_; ++i) total_ += hits_[i].weight;
}

void HitList::drop_farthest() {
  sort();
  total_ -= hits_[--size_].weight;
}

std::optional<CoverageResult> HitList::evaluate(float tau, float window) {
  sort();
  for (std::size_t a = 0; a < size_; ++a) {
    const float end = hits_[a].t + window;
    float weight = 0.0f;
    float moment = 0.0f;
    float strongest_weight = -1.0f;
    std::uint32_t strongest = 0;
    for (std::size_t b = a; b < size_ && hits_[b].t <= end; ++b) {
      weight += hits_[b].weight;
      moment += hits_[b].weight * (hits_[b].t - hits_[a].t);
      if (hits_[b].weight > strongest_weight) {
        strongest_weight = hits_[b].weight;
        strongest = hits_[b].index;
      }
    }
    if (weight >= tau) return CoverageResult{hits_[a].t, hits_[a].t + moment / weight, strongest};
  }
  return std::nullopt;
}

}  // namespace pointflight
