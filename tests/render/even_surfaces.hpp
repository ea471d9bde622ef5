// A receiver of wide beams for tests.
#pragma once

#include "pointflight/render/wide_beams.hpp"

namespace pointflight::testing {

/// All surfaces give back 0.3 whatever their angle; every echo counts.
class EvenSurfaces : public EchoReceiver {
 public:
  explicit EvenSurfaces(bool takes_strongest = false) : takes_strongest_(takes_strongest) {}
  [[nodiscard]] double reflectivity(const Hit& /*hit*/) const override { return 0.3; }
  [[nodiscard]] Reflectances reflectances() const override {
    return {.per_intensity = 0.0f, .same = 0.3f, .usual = nullptr, .least = 0.3f};
  }
  [[nodiscard]] bool is_marginal(const Echo& /*echo*/,
                                 double /*less*/,
                                 double /*more*/) const override {
    return false;
  }
  [[nodiscard]] bool takes_strongest() const override { return takes_strongest_; }

 private:
  bool takes_strongest_;
};

}  // namespace pointflight::testing
