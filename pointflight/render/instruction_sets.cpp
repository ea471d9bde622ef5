#include "pointflight/render/instruction_sets.hpp"

#include "pointflight/render/internal/beam_kernel.hpp"

namespace pointflight {

std::vector<std::string> instruction_sets() {
  return kernel_names();
}

void use_instruction_set(const std::string& name) {
  use_kernel(name);
}

}  // namespace pointflight
